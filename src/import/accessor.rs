//! Reads glTF accessors. Every offset and count is checked against the bytes that back it before
//! anything is allocated.

use super::{buffers::Buffers, buffers::ViewBytes, fault::Fault};
use ::gltf::json::{
    Accessor, Index, Root,
    accessor::{ComponentType, sparse::Sparse},
    validation::Checked,
};
use std::ops::RangeInclusive;

/// Accessors of one file.
pub(super) struct Accessors<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
}

/// The elements that an accessor or its sparse part points at, checked to lie within their view.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
    component: ComponentType,
    components: usize,
}

impl<'a> Accessors<'a> {
    pub(super) fn new(root: &'a Root, buffers: &'a Buffers<'a>) -> Self {
        Self { root, buffers }
    }

    /// Total size in bytes of all buffers as stored in the file.
    pub(super) fn total_bytes(&self) -> u64 {
        self.buffers.total_bytes()
    }

    /// Number of elements of an accessor, checked to be present.
    pub(super) fn count(&self, index: Index<Accessor>) -> Result<usize, Fault> {
        let accessor = self.accessor(index)?;
        let name = || format!("accessor {}", index.value());
        match self.elements(accessor, &name)? {
            Some(elements) => Ok(elements.count),
            None => self.count_without_data(accessor, &name),
        }
    }

    /// The elements with the indices `picks` (ascending) as `f32`: the first `N` components of
    /// each, with missing components taken from `absent`. Normalised integers become -1..1 or 0..1.
    /// Fails if the number of components of the accessor is not in `components`.
    pub(super) fn floats<const N: usize>(
        &self,
        index: Index<Accessor>,
        what: &str,
        picks: &[u32],
        components: RangeInclusive<usize>,
        absent: [f32; N],
    ) -> Result<Vec<[f32; N]>, Fault> {
        let accessor = self.accessor(index)?;
        let name = || format!("accessor {} ({what})", index.value());
        let found = self.components(accessor, &name)?;
        if !components.contains(&found) {
            return Err(Fault::broken(format!("{} has {found} components", name())));
        }
        let count = self.count(index)?;
        if let Some(&last) = picks.last().filter(|&&last| last as usize >= count) {
            return Err(Fault::broken(format!(
                "index {last} is out of range for {}, which has {count} elements",
                name()
            )));
        }
        let normalized = accessor.normalized;
        let mut values: Vec<[f32; N]> = match self.elements(accessor, &name)? {
            Some(elements) => picks.iter().map(|&i| elements.floats(i as usize, normalized, absent)).collect(),
            None => vec![[0.0; N]; picks.len()],
        };
        if let Some(sparse) = &accessor.sparse {
            let (places, replacements) = self.sparse(accessor, sparse, count, &name)?;
            for (i, place) in places.into_iter().enumerate() {
                if let Ok(picked) = picks.binary_search(&place) {
                    values[picked] = replacements.floats(i, normalized, absent);
                }
            }
        }
        Ok(values)
    }

    /// Divisor that maps integers of an accessor to -1..1 or 0..1; 1 if they are not normalised.
    pub(super) fn divisor(&self, index: Index<Accessor>) -> Result<f32, Fault> {
        let accessor = self.accessor(index)?;
        let component = component(accessor, &|| format!("accessor {}", index.value()))?;
        Ok(if accessor.normalized { greatest(component) } else { 1.0 })
    }

    /// All elements as indices; only unsigned integers are accepted.
    pub(super) fn indices(&self, index: Index<Accessor>) -> Result<Vec<u32>, Fault> {
        let accessor = self.accessor(index)?;
        let name = || format!("accessor {} (indices)", index.value());
        let component = component(accessor, &name)?;
        let is_unsigned = matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if !is_unsigned || self.components(accessor, &name)? != 1 {
            return Err(Fault::broken(format!(
                "{} has components of type {component:?}; indices must be scalar unsigned integers",
                name()
            )));
        }
        let mut values = match self.elements(accessor, &name)? {
            Some(elements) => (0..elements.count).map(|i| elements.unsigned(i)).collect(),
            None => vec![0; self.count_without_data(accessor, &name)?],
        };
        if let Some(sparse) = &accessor.sparse {
            let (places, replacements) = self.sparse(accessor, sparse, values.len(), &name)?;
            for (i, place) in places.into_iter().enumerate() {
                values[place as usize] = replacements.unsigned(i);
            }
        }
        Ok(values)
    }

    fn accessor(&self, index: Index<Accessor>) -> Result<&'a Accessor, Fault> {
        self.root.accessors.get(index.value()).ok_or_else(|| {
            Fault::broken(format!("accessor {} is referenced and {} exist", index.value(), self.root.accessors.len()))
        })
    }

    fn components(&self, accessor: &Accessor, name: &dyn Fn() -> String) -> Result<usize, Fault> {
        match &accessor.type_ {
            Checked::Valid(kind) => Ok(kind.multiplicity()),
            Checked::Invalid => Err(Fault::broken(format!("{} has an unknown type", name()))),
        }
    }

    fn elements(&self, accessor: &Accessor, name: &dyn Fn() -> String) -> Result<Option<Elements<'_>>, Fault> {
        let Some(view) = accessor.buffer_view else { return Ok(None) };
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let components = self.components(accessor, name)?;
        let view = self.buffers.view(view)?;
        elements(view, offset, accessor.count.0, component(accessor, name)?, components, name).map(Some)
    }

    /// An accessor without data is all zeros, of any count; a count larger than the size of the
    /// file is refused.
    fn count_without_data(&self, accessor: &Accessor, name: &dyn Fn() -> String) -> Result<usize, Fault> {
        let count = accessor.count.0;
        if count > self.buffers.total_bytes() {
            return Err(Fault::broken(format!("{} declares {count} elements but has no buffer view", name())));
        }
        Ok(count as usize)
    }

    fn sparse(
        &self,
        accessor: &Accessor,
        sparse: &Sparse,
        count: usize,
        name: &dyn Fn() -> String,
    ) -> Result<(Vec<u32>, Elements<'_>), Fault> {
        let name = || format!("{}, sparse part", name());
        let Checked::Valid(index_type) = &sparse.indices.component_type else {
            return Err(Fault::broken(format!("{}: its indices are not unsigned integers", name())));
        };
        let view = self.buffers.view(sparse.indices.buffer_view)?;
        let places = elements(view, sparse.indices.byte_offset.0, sparse.count.0, index_type.0, 1, &name)?;
        let places: Vec<u32> = (0..places.count).map(|i| places.unsigned(i)).collect();
        if let Some(place) = places.iter().find(|&&place| place as usize >= count) {
            return Err(Fault::broken(format!("{} replaces element {place} of {count}", name())));
        }
        let view = self.buffers.view(sparse.values.buffer_view)?;
        let components = self.components(accessor, &name)?;
        let offset = sparse.values.byte_offset.0;
        let values = elements(view, offset, sparse.count.0, component(accessor, &name)?, components, &name)?;
        Ok((places, values))
    }
}

fn component(accessor: &Accessor, name: &dyn Fn() -> String) -> Result<ComponentType, Fault> {
    match &accessor.component_type {
        Checked::Valid(component) => Ok(component.0),
        Checked::Invalid => Err(Fault::broken(format!("{} has an unknown component type", name()))),
    }
}

fn elements<'b>(
    view: ViewBytes<'b>,
    offset: u64,
    count: u64,
    component: ComponentType,
    components: usize,
    name: &dyn Fn() -> String,
) -> Result<Elements<'b>, Fault> {
    let size = component.size() * components;
    let stride = view.stride.unwrap_or(size);
    let needed = match count {
        0 => Some(0),
        _ => (count - 1).checked_mul(stride as u64).and_then(|bytes| bytes.checked_add(size as u64)),
    };
    let bytes = usize::try_from(offset).ok().and_then(|offset| view.bytes.get(offset..));
    let fits = bytes.filter(|bytes| needed.is_some_and(|needed| needed <= bytes.len() as u64));
    let bytes = fits.filter(|_| stride >= size).ok_or_else(|| {
        Fault::broken(format!(
            "{}: {count} elements of {size} bytes every {stride} bytes from byte {offset} do not fit into its view of {} bytes",
            name(),
            view.bytes.len()
        ))
    })?;
    Ok(Elements { bytes, stride, count: count as usize, component, components })
}

impl Elements<'_> {
    fn floats<const N: usize>(&self, i: usize, normalized: bool, absent: [f32; N]) -> [f32; N] {
        let mut values = absent;
        let bytes = self.bytes[i * self.stride..].chunks_exact(self.component.size());
        for (value, bytes) in values.iter_mut().zip(bytes.take(self.components)) {
            *value = match (self.component, bytes) {
                (ComponentType::I8, &[a]) => f32::from(a as i8),
                (ComponentType::U8, &[a]) => f32::from(a),
                (ComponentType::I16, &[a, b]) => f32::from(i16::from_le_bytes([a, b])),
                (ComponentType::U16, &[a, b]) => f32::from(u16::from_le_bytes([a, b])),
                (ComponentType::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]) as f32,
                (ComponentType::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
                _ => 0.0,
            };
            if normalized && self.component != ComponentType::F32 {
                *value = (*value / greatest(self.component)).max(-1.0);
            }
        }
        values
    }

    fn unsigned(&self, i: usize) -> u32 {
        match (self.component, &self.bytes[i * self.stride..]) {
            (ComponentType::U8, &[a, ..]) => u32::from(a),
            (ComponentType::U16, &[a, b, ..]) => u32::from(u16::from_le_bytes([a, b])),
            (ComponentType::U32, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]),
            _ => 0,
        }
    }
}

/// The integer that represents 1 when normalised.
fn greatest(component: ComponentType) -> f32 {
    match component {
        ComponentType::I8 => 127.0,
        ComponentType::U8 => 255.0,
        ComponentType::I16 => 32767.0,
        ComponentType::U16 => 65535.0,
        ComponentType::U32 => u32::MAX as f32,
        ComponentType::F32 => 1.0,
    }
}
