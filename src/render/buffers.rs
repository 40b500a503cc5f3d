//! Buffers that are kept between frames and replaced when they get too small.

/// An empty buffer of `size` bytes.
pub(super) fn buffer(device: &wgpu::Device, label: &str, usage: wgpu::BufferUsages, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
}

/// A buffer of `contents`. Where the device fails it stays empty, and the device tells.
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

/// Replaces a buffer that is too small by one with an eighth to spare, and tells so. The old content is lost.
pub(super) fn grow(device: &wgpu::Device, old: &mut wgpu::Buffer, bytes: u64) -> bool {
    let is_too_small = old.size() < bytes;
    if is_too_small {
        let limit = device.limits().max_storage_buffer_binding_size;
        let spare = (bytes + bytes / 8).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT).min(limit).max(bytes);
        *old = buffer(device, "grown", old.usage(), spare);
    }
    is_too_small
}
