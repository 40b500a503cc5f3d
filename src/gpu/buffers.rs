//! Buffers that are reused between frames and replaced when they are too small.

/// Creates a zeroed buffer of `size` bytes.
pub(super) fn buffer(device: &wgpu::Device, label: &str, usage: wgpu::BufferUsages, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
}

/// Creates a buffer with `contents`, padded to a multiple of 4 bytes. If the device fails, the
/// buffer stays empty and the device reports the error.
pub(super) fn filled(device: &wgpu::Device, label: &str, usage: wgpu::BufferUsages, contents: &[u8]) -> wgpu::Buffer {
    let size = (contents.len() as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
    let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: true };
    let buffer = device.create_buffer(&descriptor);
    if let Ok(mut mapped) = buffer.get_mapped_range_mut(..) {
        mapped.slice(..contents.len()).copy_from_slice(contents);
    }
    buffer.unmap();
    buffer
}

/// Replaces a buffer smaller than `bytes` by one with up to an eighth of spare room, and returns
/// whether it did. The old content is not copied.
pub(super) fn grow(device: &wgpu::Device, old: &mut wgpu::Buffer, bytes: u64) -> bool {
    let is_too_small = old.size() < bytes;
    if is_too_small {
        let limit = device.limits().max_storage_buffer_binding_size;
        let spare = (bytes + bytes / 8).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT).min(limit).max(bytes);
        *old = buffer(device, "grown", old.usage(), spare);
    }
    is_too_small
}
