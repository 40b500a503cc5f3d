// Timeline: drawn scale of a leaf at any active count, without state. Declare the events in your
// shader: @group(G) @binding(B) var<storage, read> events: array<Event>;

// When the active count falls to `leaf`, the drawn scale of the event's owner becomes `scale`.
struct Event {
    leaf: u32,
    scale: f32,
}

// Index of a leaf's first event, from `first_event` up to but excluding `end_event`, whose `leaf`
// is at least `count`; `end_event` if there is none. Its scale is the drawn scale at the active
// count `count`.
fn event_at(first_event: u32, end_event: u32, count: u32) -> u32 {
    var low = first_event;
    var high = end_event;
    while low < high {
        let middle = (low + high) / 2u;
        if events[middle].leaf < count {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

// Scale of an event; 1 for `end_event`.
fn scale_of(event: u32, end_event: u32) -> f32 {
    return select(1.0, events[min(event, arrayLength(&events) - 1u)].scale, event < end_event);
}

// Drawn scale during a transition of a leaf whose own presence, as a share of its area, is `own`.
fn scale_in(first_event: u32, end_event: u32, own: f32, transition: Transition) -> f32 {
    // The first event whose leaf may be only partly present.
    var event = event_at(first_event, end_event, transition.first_partial);
    let is_still = event >= end_event || events[event].leaf >= transition.drawn;
    if is_still && own == 1.0 {
        return scale_of(event, end_event);
    }
    var area = 0.0;
    while event < end_event && events[event].leaf < transition.drawn {
        let gone = 1.0 - presence(events[event].leaf, transition);
        area += gone * (pow2(scale_of(event, end_event)) - pow2(scale_of(event + 1u, end_event)));
        event += 1u;
    }
    return sqrt(max(pow2(scale_of(event, end_event)) + area, 0.0) * own);
}
