//! The axis of a file that points up.

use super::{Warning, WarningKind, source::Source};
use glam::{DAffine3, DMat3, DVec3};
use std::{collections::HashMap, rc::Rc};
use strum::{Display, EnumMessage, EnumString, IntoStaticStr, VariantArray};

/// The axis of a file that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Display, EnumMessage, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub enum Up {
    /// The y axis, as in glTF and in most OBJ files.
    #[default]
    Y,
    /// The z axis, as in modelling programs: (x, y, z) becomes (x, z, -y).
    Z,
}

/// Minimum length of a plant along z over its length along y that suggests that z points up.
const LONG: f64 = 1.25;
/// Maximum distance of its base from z = 0, as a fraction of its length.
const BASE: f64 = 0.05;
/// Maximum distance of its middle from y = 0, as a fraction of its thickness. A plant that stands
/// along y has its base there instead, and its middle at half its height.
const MIDDLE: f64 = 0.25;

/// Turns the plant so that y points up, or returns a warning if it seems to lie on its side.
pub(super) fn turn(source: &mut Source, up: Up) -> Option<Warning> {
    match up {
        Up::Y => lies(source).then(|| {
            let message = "the plant seems to lie on its side: it is longest along z, where it starts at 0";
            Warning::new(WarningKind::Up, message, "if it does, use `Up::Z`")
        }),
        Up::Z => {
            turn_to_y(source);
            None
        }
    }
}

fn lies(source: &Source) -> bool {
    source.bounds().is_some_and(|[low, high]| {
        let size = high - low;
        let starts_at_zero = low.z.abs() <= BASE * size.z;
        let is_centered = low.midpoint(high).y.abs() <= MIDDLE * size.y;
        size.z >= LONG * size.y && starts_at_zero && is_centered
    })
}

/// Places, and the same once they are turned. The first are kept so that their address stays
/// theirs.
type Turned = (Rc<[DAffine3]>, Rc<[DAffine3]>);

/// Turns every place; places that parts share stay shared.
fn turn_to_y(source: &mut Source) {
    let turn = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y));
    let mut known: HashMap<*const DAffine3, Turned> = HashMap::new();
    for part in &mut source.parts {
        let turned = || -> Rc<[DAffine3]> { part.places.iter().map(|place| turn * *place).collect() };
        let entry = known.entry(part.places.as_ptr()).or_insert_with(|| (Rc::clone(&part.places), turned()));
        part.places = Rc::clone(&entry.1);
    }
}
