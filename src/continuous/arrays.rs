//! Accessors as arrays of numbers.

use super::{
    damaged,
    file::{File, Primitive},
};
use crate::{Error, Result};

/// Component types.
const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
/// How often the bytes of a file may be read on average: primitives may share accessors, but not
/// without end.
const SHARED: usize = 2;

/// The accessors of a file, and how many bytes may still be read from them.
pub(super) struct Arrays<'a> {
    file: &'a File<'a>,
    left: usize,
}

/// The bytes of an accessor, row by row.
struct Rows<'a> {
    bytes: &'a [u8],
    component: u32,
    normalized: bool,
    count: usize,
    stride: usize,
    columns: usize,
}

impl<'a> Arrays<'a> {
    pub(super) fn new(file: &'a File<'a>) -> Self {
        Self { file, left: SHARED * file.length }
    }

    /// An attribute with N components; `None` if the primitive lacks it.
    pub(super) fn vectors<const N: usize>(
        &mut self,
        primitive: &Primitive,
        name: &str,
    ) -> Result<Option<Vec<[f32; N]>>> {
        let Some(&accessor) = primitive.attributes.get(name) else { return Ok(None) };
        let rows = self.rows(accessor, name)?;
        if rows.columns != N {
            return Err(damaged(format!("{name} has {} components, not {N}", rows.columns)));
        }
        Ok(Some((0..rows.count).map(|row| std::array::from_fn(|column| rows.number(row, column))).collect()))
    }

    /// Colours, whose alpha may be left out.
    pub(super) fn colors(&mut self, primitive: &Primitive) -> Result<Option<Vec<[f32; 4]>>> {
        let Some(&accessor) = primitive.attributes.get("COLOR_0") else { return Ok(None) };
        let rows = self.rows(accessor, "COLOR_0")?;
        if !(3..=4).contains(&rows.columns) {
            return Err(damaged(format!("COLOR_0 has {} components", rows.columns)));
        }
        let part = |row, column| if column < rows.columns { rows.number(row, column) } else { 1.0 };
        Ok(Some((0..rows.count).map(|row| std::array::from_fn(|column| part(row, column))).collect()))
    }

    /// Whether positions are integers and pivots are not, or not the same ones.
    pub(super) fn are_pivots_left_behind(&self, primitive: &Primitive) -> bool {
        let kind = |name: &str| {
            let accessor = self.file.json.accessors.get(*primitive.attributes.get(name)?)?;
            Some((accessor.component_type, accessor.normalized))
        };
        let [positions, pivots] = ["POSITION", "_PIVOT"].map(kind);
        positions.is_some_and(|(component, _)| component != FLOAT) && positions != pivots
    }

    /// Indices of whole triangles below `vertices`; one after the other without an accessor.
    pub(super) fn indices(&mut self, accessor: Option<usize>, vertices: usize) -> Result<Vec<u32>> {
        let indices: Vec<u32> = match accessor {
            None => (0..vertices as u32).collect(),
            Some(accessor) => {
                let rows = self.rows(accessor, "an index")?;
                if rows.columns != 1 || ![UNSIGNED_BYTE, UNSIGNED_SHORT, UNSIGNED_INT].contains(&rows.component) {
                    return Err(damaged("indices are no unsigned integers"));
                }
                (0..rows.count).map(|row| rows.integer(row)).collect()
            }
        };
        if !indices.len().is_multiple_of(3) {
            return Err(damaged(format!("{} indices are no whole triangles", indices.len())));
        }
        match indices.iter().find(|index| **index as usize >= vertices) {
            Some(index) => Err(damaged(format!("there is no vertex {index} of {vertices}"))),
            None => Ok(indices),
        }
    }

    fn rows(&mut self, number: usize, name: &str) -> Result<Rows<'a>> {
        let accessor = self.file.json.accessors.get(number);
        let accessor = accessor.ok_or_else(|| damaged(format!("there is no accessor {number} for {name}")))?;
        let view = accessor.buffer_view.filter(|_| accessor.sparse.is_none());
        let Some(view) = view else {
            return Err(Error::unreadable("model", "an accessor is sparse or empty", "write it with dense accessors"));
        };
        let width = match accessor.component_type {
            BYTE | UNSIGNED_BYTE => 1,
            SHORT | UNSIGNED_SHORT => 2,
            UNSIGNED_INT | FLOAT => 4,
            other => return Err(damaged(format!("{name} is of component type {other}"))),
        };
        let columns = match accessor.shape.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => return Err(damaged(format!("{name} is neither a number nor a vector"))),
        };
        let bytes = self.file.view(view)?;
        let size = width * columns;
        let stride = self.file.json.buffer_views[view].byte_stride.unwrap_or(size);
        let beyond = || damaged(format!("{name} reaches beyond its data"));
        let rest = bytes.get(accessor.byte_offset..).ok_or_else(beyond)?;
        let used = match accessor.count {
            0 => Some(0),
            count => (count - 1).checked_mul(stride).and_then(|start| start.checked_add(size)),
        };
        if stride < size || used.is_none_or(|used| used > rest.len()) {
            return Err(beyond());
        }
        let data = size * accessor.count;
        self.left = self.left.checked_sub(data).ok_or_else(|| damaged("its primitives share their data"))?;
        Ok(Rows {
            bytes: rest,
            component: accessor.component_type,
            normalized: accessor.normalized,
            count: accessor.count,
            stride,
            columns,
        })
    }
}

impl Rows<'_> {
    fn number(&self, row: usize, column: usize) -> f32 {
        let fraction = |value: f32, most: f32| if self.normalized { (value / most).max(-1.0) } else { value };
        match self.component {
            BYTE => fraction(f32::from(i8::from_le_bytes(self.raw(row, column))), 127.0),
            UNSIGNED_BYTE => fraction(f32::from(u8::from_le_bytes(self.raw(row, column))), 255.0),
            SHORT => fraction(f32::from(i16::from_le_bytes(self.raw(row, column))), 32767.0),
            UNSIGNED_SHORT => fraction(f32::from(u16::from_le_bytes(self.raw(row, column))), 65535.0),
            UNSIGNED_INT => u32::from_le_bytes(self.raw(row, column)) as f32,
            _ => f32::from_le_bytes(self.raw(row, column)),
        }
    }

    fn integer(&self, row: usize) -> u32 {
        match self.component {
            UNSIGNED_BYTE => u32::from(u8::from_le_bytes(self.raw(row, 0))),
            UNSIGNED_SHORT => u32::from(u16::from_le_bytes(self.raw(row, 0))),
            _ => u32::from_le_bytes(self.raw(row, 0)),
        }
    }

    /// The bytes of a component. That they are within the data was checked.
    fn raw<const B: usize>(&self, row: usize, column: usize) -> [u8; B] {
        let at = row * self.stride + column * B;
        std::array::from_fn(|byte| self.bytes[at + byte])
    }
}
