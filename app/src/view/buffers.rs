//! Buffers of the GPU that grow with what is written into them.
//!
//! Comes in: bytes. Goes out: buffers. Does not know what is in them.

use super::marks::Mark;
use std::ops::Range;

/// The smallest buffer.
const LEAST_BYTES: u64 = size_of::<Mark>() as u64;

/// Puts `bytes` into `buffer`, or into a larger one.
pub(super) fn fill(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &mut wgpu::Buffer, bytes: &[u8]) {
    if buffer.size() < bytes.len() as u64 {
        *buffer = vertex_buffer(device, bytes.len() as u64);
    }
    queue.write_buffer(buffer, 0, bytes);
}

/// A buffer for `bytes` bytes of corners or marks.
pub(super) fn vertex_buffer(device: &wgpu::Device, bytes: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("vertices"),
        size: bytes.max(LEAST_BYTES).next_power_of_two(),
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Marks on the GPU.
pub(super) struct Instances {
    pub(super) buffer: wgpu::Buffer,
    count: u32,
}

impl Instances {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        Self { buffer: vertex_buffer(device, LEAST_BYTES), count: 0 }
    }

    /// These marks and no others.
    pub(super) fn set(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, marks: &[Mark]) {
        self.count = marks.len() as u32;
        fill(device, queue, &mut self.buffer, bytemuck::cast_slice(marks));
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.draw_some(pass, std::iter::once(0..self.count));
    }

    /// How many there are.
    pub(super) fn count(&self) -> u32 {
        self.count
    }

    /// Draws those in `ranges`, in order.
    pub(super) fn draw_some(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        ranges: impl IntoIterator<Item = Range<u32>>,
    ) {
        pass.set_vertex_buffer(0, self.buffer.slice(..));
        for range in ranges.into_iter().filter(|range| !range.is_empty()) {
            pass.draw(0..4, range);
        }
    }
}
