//! GPU buffers that grow with their content.

const LEAST_BYTES: u64 = 32;

/// Writes `bytes` to `buffer`; replaces the buffer if it is too small.
pub(super) fn fill(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &mut wgpu::Buffer, bytes: &[u8]) {
    if buffer.size() < bytes.len() as u64 {
        *buffer = vertex_buffer(device, bytes.len() as u64);
    }
    queue.write_buffer(buffer, 0, bytes);
}

/// A vertex buffer of this size.
pub(super) fn vertex_buffer(device: &wgpu::Device, bytes: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("vertices"),
        size: bytes.max(LEAST_BYTES).next_power_of_two(),
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
