// The 2D view: ground (background, board without outline, grid), the board's body (triangles of its outline),
// layers (triangles of one colour each), and marks (strokes and discs). Distances are in device pixels from
// the middle of the window, Y up. Colours are linear light.

struct Frame {
  // center of the window in mm; half its size in device pixels
  centre: vec2f, half_px: vec2f,
  // device pixels per mm; device pixels per CSS pixel; grid step in mm, 0 for none; opacity of the fine grid
  px_per_mm: f32, density: f32, grid_mm: f32, grid_fade: f32,
  // board: lower left and upper right corner in mm
  plate: vec4f,
  // corner radius of the board in mm; 1 if there is a board
  corner_mm: f32, has_plate: f32,
  // discs with a lower number are done; lines with a lower number are done
  discs: u32, lines: u32,
  // 1 if disc number `discs` is being drilled
  drilling: u32,
  // -1 if the board is seen from below and X points left, else 1
  hand: f32, unused_b: u32, unused_c: u32,
  background: vec4f, body: vec4f, edge: vec4f, grid: vec4f, bore: vec4f,
  done: vec4f, current: vec4f, failed: vec4f, selected: vec4f, travelled: vec4f,
}
@group(0) @binding(0) var<uniform> frame: Frame;

// Mirrors X if the board is seen from below.
fn handed() -> vec2f { return vec2f(frame.hand, 1.0); }

// Coverage of a pixel whose center is `distance` pixels outside an edge.
fn inside(distance: f32) -> f32 { return clamp(0.5 - distance, 0.0, 1.0); }

// Coverage of a band of `width` around an edge.
fn band(distance: f32, width: f32) -> f32 { return inside(abs(distance) - 0.5 * width); }

// Blends `top` over the opaque `under`, straight alpha.
fn over(under: vec3f, top: vec3f, share: f32) -> vec3f { return mix(under, top, clamp(share, 0.0, 1.0)); }

// ---- ground ----------------------------------------------------------------------------------------------

@vertex fn ground_corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
  let corner = vec2f(f32(index & 1u), f32(index >> 1u));
  return vec4f(corner * 4.0 - 1.0, 0.0, 1.0);
}

fn plate_distance(at_px: vec2f) -> f32 {
  let low = (frame.plate.xy - frame.centre) * frame.px_per_mm;
  let high = (frame.plate.zw - frame.centre) * frame.px_per_mm;
  let corner = frame.corner_mm * frame.px_per_mm;
  let off = abs(at_px * handed() - 0.5 * (low + high)) - 0.5 * (high - low) + corner;
  return length(max(off, vec2f(0.0))) + min(max(off.x, off.y), 0.0) - corner;
}

// Lines every `step_mm`, one CSS pixel wide.
fn grid_lines(at_mm: vec2f, step_mm: f32) -> f32 {
  let off = abs(at_mm - round(at_mm / step_mm) * step_mm) * frame.px_per_mm;
  let lines = vec2f(inside(off.x - 0.5 * frame.density), inside(off.y - 0.5 * frame.density));
  return max(lines.x, lines.y);
}

fn from_middle(position: vec4f) -> vec2f {
  return vec2f(position.x - frame.half_px.x, frame.half_px.y - position.y);
}

fn grid_share(at_px: vec2f) -> f32 {
  if frame.grid_mm <= 0.0 { return 0.0; }
  let at_mm = frame.centre + at_px * handed() / frame.px_per_mm;
  let fine = grid_lines(at_mm, frame.grid_mm) * frame.grid_fade;
  return max(fine * 0.55, grid_lines(at_mm, frame.grid_mm * 10.0));
}

// A slight gradient from above, so that the board looks solid.
fn board_colour(at_px: vec2f, grid: f32) -> vec3f {
  let lit = 1.0 + 0.10 * clamp(at_px.y / frame.half_px.y, -1.0, 1.0);
  return over(frame.body.rgb * lit, frame.grid.rgb, grid * 0.075);
}

@fragment fn ground_colour(@builtin(position) position: vec4f) -> @location(0) vec4f {
  let at_px = from_middle(position);
  let grid = grid_share(at_px);
  var colour = over(frame.background.rgb, frame.grid.rgb, grid * 0.045);
  if frame.has_plate > 0.5 {
    let distance = plate_distance(at_px);
    let below = plate_distance(at_px + vec2f(0.0, 5.0 * frame.density));
    let shadow = exp(-max(below, 0.0) / (9.0 * frame.density));
    colour = colour * (1.0 - 0.34 * shadow);
    colour = over(colour, board_colour(at_px, grid), inside(distance));
    colour = over(colour, frame.edge.rgb, band(distance + 0.75 * frame.density, 1.5 * frame.density));
  }
  return vec4f(colour, 1.0);
}

// ---- body ------------------------------------------------------------------------------------------------

fn in_window(corner: vec2f) -> vec4f {
  return vec4f((corner - frame.centre) * handed() * frame.px_per_mm / frame.half_px, 0.0, 1.0);
}

@vertex fn body_corner(@location(0) corner: vec2f) -> @builtin(position) vec4f { return in_window(corner); }

@fragment fn body_colour(@builtin(position) position: vec4f) -> @location(0) vec4f {
  let at_px = from_middle(position);
  return vec4f(board_colour(at_px, grid_share(at_px)), 1.0);
}

// ---- layers ----------------------------------------------------------------------------------------------

struct Area { @builtin(position) position: vec4f, @location(0) @interpolate(flat) colour: vec4f }

@vertex fn layer_corner(@location(0) corner: vec2f, @location(1) colour: vec4f) -> Area {
  let tint = linear(colour);
  return Area(in_window(corner), vec4f(tint.rgb * tint.a, tint.a));
}

// Edges of filled areas: lighter, and fading in with the zoom. At small zooms the edges would hide the areas.
@vertex fn edge_corner(@location(0) corner: vec2f, @location(1) colour: vec4f) -> Area {
  let tint = linear(colour);
  let light = mix(tint.rgb, vec3f(1.0), 0.45);
  let share = tint.a * smoothstep(8.0, 24.0, frame.px_per_mm / frame.density);
  return Area(in_window(corner), vec4f(light * share, share));
}

@fragment fn layer_colour(area: Area) -> @location(0) vec4f { return area.colour; }

// ---- marks -----------------------------------------------------------------------------------------------

const DISC = 8u; const SELECTED = 16u; const HOVERED = 32u;
const DONE = 1u; const CURRENT = 2u; const SKIPPED = 3u; const FAILED = 4u; const DIMMED = 5u;
const UNORDERED = 0xffffffu;

struct Stroke {
  @builtin(position) position: vec4f,
  // position along the stroke from `a`, and across it, in pixels
  @location(0) at: vec2f,
  // length of the stroke; radius of its ends, in pixels
  @location(1) @interpolate(flat) shape: vec2f,
  @location(2) @interpolate(flat) colour: vec4f,
  @location(3) @interpolate(flat) bits: u32,
}

fn linear(colour: vec4f) -> vec4f {
  let low = colour.rgb / 12.92;
  let high = pow((colour.rgb + 0.055) / 1.055, vec3f(2.4));
  return vec4f(select(high, low, colour.rgb <= vec3f(0.04045)), colour.a);
}

// The bits of a mark, with the state changed by the plan's progress.
fn progressed(bits: u32) -> u32 {
  let order = bits >> 8u;
  if (bits & DISC) == 0u || (bits & 7u) != 0u || order == UNORDERED { return bits; }
  if order < frame.discs { return bits | DONE; }
  if order == frame.discs && frame.drilling == 1u { return bits | CURRENT; }
  return bits;
}

// A mark: its two ends in mm, then radius in mm, radius in pixels, colour and bits.
@group(1) @binding(0) var marks: texture_2d<u32>;

@vertex fn stroke_corner(@builtin(vertex_index) number: u32) -> Stroke {
  // Two triangles: corners 0 1 2 and 2 1 3.
  let turn = number % 6u;
  let index = select(turn, 5u - turn, turn > 2u) | select(0u, 3u, turn == 5u);
  let mark = number / 6u;
  let texel = vec2u(2u * (mark % 1024u), mark / 1024u);
  let ends = bitcast<vec4f>(textureLoad(marks, texel, 0));
  let rest = textureLoad(marks, texel + vec2u(1u, 0u), 0);
  let radii = bitcast<vec2f>(rest.xy);
  let colour = vec4f((vec4u(rest.z) >> vec4u(0u, 8u, 16u, 24u)) & vec4u(255u)) / 255.0;
  let own_bits = rest.w;
  let a = (ends.xy - frame.centre) * handed() * frame.px_per_mm;
  let b = (ends.zw - frame.centre) * handed() * frame.px_per_mm;
  let length_px = length(b - a);
  var along = vec2f(1.0, 0.0);
  if length_px > 0.001 { along = (b - a) / length_px; }
  let bits = progressed(own_bits);
  let is_disc = (bits & DISC) != 0u;
  var radius = radii.x * frame.px_per_mm + radii.y * frame.density;
  var tint = linear(colour);
  if is_disc {
    radius = max(radius, 1.4 * frame.density);
  } else {
    if (bits >> 8u) < frame.lines { tint = frame.travelled; }
    // A thinner line is drawn at this width, but fainter.
    let thinnest = 0.5;
    tint.a = tint.a * clamp(radius / thinnest, 0.0, 1.0);
    radius = max(radius, thinnest);
  }
  var room = 1.0;
  if (bits & (SELECTED | HOVERED)) != 0u || (bits & 7u) == CURRENT || (bits & 7u) == FAILED { room = 9.0 * frame.density; }
  let reach = radius + room;
  let corner = vec2f(
    select(-reach, length_px + reach, (index & 1u) == 1u),
    select(-reach, reach, (index & 2u) == 2u),
  );
  let place = a + along * corner.x + vec2f(-along.y, along.x) * corner.y;
  var out: Stroke;
  out.position = vec4f(place / frame.half_px, 0.0, 1.0);
  out.at = corner;
  out.shape = vec2f(length_px, radius);
  out.colour = tint;
  out.bits = bits;
  return out;
}

// Blends `top` over `under`, premultiplied.
fn lay(under: vec4f, top: vec3f, share: f32) -> vec4f {
  return under * (1.0 - share) + vec4f(top, 1.0) * share;
}

// Separate from discs, because most marks are lines: a software renderer executes the whole shader for each
// pixel.
@fragment fn line_colour(stroke: Stroke) -> @location(0) vec4f {
  let off = stroke.at - vec2f(clamp(stroke.at.x, 0.0, stroke.shape.x), 0.0);
  return lay(vec4f(0.0), stroke.colour.rgb, stroke.colour.a * inside(length(off) - stroke.shape.y));
}

@fragment fn disc_colour(stroke: Stroke) -> @location(0) vec4f {
  let state = stroke.bits & 7u;
  let density = frame.density;
  let radius = stroke.shape.y;
  let from_centre = length(stroke.at);
  let distance = from_centre - radius;
  let rim = clamp(0.30 * radius, 1.25 * density, 4.5 * density);
  // The bore is darker under its upper edge, so that it looks like a hole.
  let depth = clamp(0.5 + 0.5 * stroke.at.y / radius, 0.0, 1.0);
  let bore = frame.bore.rgb * (1.25 - 0.6 * depth);
  var fill = bore;
  var ring = stroke.colour.rgb;
  var ring_width = rim;
  if state == DONE { fill = frame.done.rgb; ring = frame.done.rgb * 0.45; ring_width = 0.45 * rim; }
  if state == CURRENT { ring = frame.current.rgb; }
  if state == FAILED { ring = frame.failed.rgb; }
  var out = lay(vec4f(0.0), mix(fill, ring, inside(-distance - ring_width)), inside(distance));
  let slash = abs(stroke.at.x + stroke.at.y) * 0.70711;
  let backslash = abs(stroke.at.x - stroke.at.y) * 0.70711;
  if state == SKIPPED { out = lay(out * 0.6, ring, inside(slash - 0.5 * ring_width) * inside(distance)); }
  if state == FAILED {
    out = lay(out, ring, inside(min(slash, backslash) - 0.6 * ring_width) * inside(distance));
  }
  if state == DIMMED { out = out * 0.35; }
  if state == FAILED {
    out = lay(out, frame.bore.rgb, band(distance - 1.5 * density, 3.0 * density));
    out = lay(out, ring, band(distance - 4.0 * density, 2.0 * density));
  }
  if state == CURRENT {
    out = lay(out, frame.current.rgb, band(distance - 4.0 * density, 2.0 * density));
  }
  if (stroke.bits & SELECTED) != 0u {
    out = lay(out, frame.selected.rgb, band(distance - 3.0 * density, 2.0 * density));
    out = lay(out, frame.selected.rgb, 0.25 * (1.0 - smoothstep(3.0 * density, 8.0 * density, distance)) * inside(-distance));
  } else if (stroke.bits & HOVERED) != 0u {
    out = lay(out, frame.selected.rgb, 0.6 * band(distance - 2.5 * density, 1.5 * density));
  }
  return out;
}

@fragment fn head_colour(stroke: Stroke) -> @location(0) vec4f {
  let density = frame.density;
  let from_centre = length(stroke.at);
  let away = abs(stroke.at);
  let cross = min(away.x, away.y) - 0.75 * density;
  let arms = inside(max(cross, 4.0 * density - from_centre)) * inside(from_centre - stroke.shape.y);
  let ring = band(from_centre - 9.0 * density, 1.5 * density);
  let shade = max(inside(max(cross - density, 3.0 * density - from_centre)) * inside(from_centre - stroke.shape.y),
    band(from_centre - 9.0 * density, 3.5 * density));
  return lay(vec4f(0.0, 0.0, 0.0, 0.45 * shade), stroke.colour.rgb, max(arms, ring));
}
