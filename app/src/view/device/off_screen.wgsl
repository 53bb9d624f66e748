// Composes an off-screen picture onto the window.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var between: sampler;

struct Place { @builtin(position) position: vec4f, @location(0) share: vec2f }

@vertex fn corner(@builtin(vertex_index) index: u32) -> Place {
  let at = vec2f(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
  return Place(vec4f(at, 0.0, 1.0), vec2f(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y));
}

// For a picture of the window's size.
@fragment fn same(place: Place) -> @location(0) vec4f {
  return textureLoad(picture, vec2i(place.position.xy), 0);
}

// For a smaller picture.
@fragment fn stretched(place: Place) -> @location(0) vec4f {
  return textureSampleLevel(picture, between, place.share, 0.0);
}
