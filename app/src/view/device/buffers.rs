//! Buffers of the GPU that grow with what is written into them.
//!
//! Comes in: bytes. Goes out: buffers. Does not know what is in them.

/// The smallest buffer.
const LEAST_BYTES: u64 = 32;

/// Puts `bytes` into `buffer`, or into a larger one.
pub(super) fn fill(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &mut wgpu::Buffer, bytes: &[u8]) {
    if buffer.size() < bytes.len() as u64 {
        *buffer = vertex_buffer(device, bytes.len() as u64);
    }
    queue.write_buffer(buffer, 0, bytes);
}

/// A buffer for `bytes` bytes of corners.
pub(super) fn vertex_buffer(device: &wgpu::Device, bytes: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("vertices"),
        size: bytes.max(LEAST_BYTES).next_power_of_two(),
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
