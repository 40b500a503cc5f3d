//! `KHR_draco_mesh_compression`, decoded by `draco-core`.

use super::fault::Fault;
use crate::plant::MAX_ELEMENTS;
use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};

/// Maximum size of one decoded primitive: 64 bytes per byte of its stream, but at least 16 MB and
/// at most 48 bytes for each of 2^24 vertices.
const MAX_DECODED_BYTES: u64 = 48 << 24;
const MAX_EXPANSION: u64 = 64;
const ALWAYS_BYTES: u64 = 16_000_000;

/// A decoded primitive.
pub(super) struct DracoMesh(Mesh);

impl DracoMesh {
    /// Decodes the stream of one primitive.
    pub(super) fn decode(stream: &[u8]) -> Result<Self, Fault> {
        let decoded_bytes = (stream.len() as u64 * MAX_EXPANSION).clamp(ALWAYS_BYTES, MAX_DECODED_BYTES);
        let limits = DecodeLimits::default()
            .with_max_points(MAX_ELEMENTS as u64)
            .with_max_faces(MAX_ELEMENTS as u64 / 3)
            .with_max_decoded_bytes(decoded_bytes);
        let mut mesh = Mesh::new();
        let mut buffer = DecoderBuffer::new(stream).with_limits(limits);
        let decoded = MeshDecoder::new().decode(&mut buffer, &mut mesh);
        decoded.map_err(|error| Fault::broken(format!("KHR_draco_mesh_compression: {error}").replace('\n', " ")))?;
        Ok(Self(mesh))
    }

    /// Three indices per triangle.
    pub(super) fn indices(&self) -> Vec<u32> {
        self.0.faces().iter().flat_map(|face| face.map(|corner| corner.0)).collect()
    }

    /// The elements with the indices `picks` of the attribute with the Draco unique id `id`,
    /// divided by `divisor`; missing components are taken from `absent`.
    pub(super) fn floats<const N: usize>(
        &self,
        id: u64,
        picks: &[u32],
        divisor: f32,
        absent: [f32; N],
    ) -> Result<Vec<[f32; N]>, Fault> {
        let attribute = u32::try_from(id).ok().and_then(|id| self.0.attribute_by_unique_id(id));
        let attribute = attribute
            .ok_or_else(|| Fault::broken(format!("KHR_draco_mesh_compression: attribute {id} is not in the stream")))?;
        let points = self.0.num_points();
        if let Some(&last) = picks.last().filter(|&&last| last as usize >= points) {
            return Err(Fault::broken(format!(
                "KHR_draco_mesh_compression: index {last} is out of range for its {points} points"
            )));
        }
        let components = usize::from(attribute.num_components()).min(N);
        let values = attribute.read_f32s(points, components);
        let element = |&pick: &u32| {
            let mut element = absent;
            for (value, stored) in element.iter_mut().zip(&values[pick as usize * components..][..components]) {
                *value = stored / divisor;
            }
            element
        };
        Ok(picks.iter().map(element).collect())
    }
}
