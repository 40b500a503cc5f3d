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
