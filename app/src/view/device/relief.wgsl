// A carved board: each pixel casts a ray through the depth field, cell by cell, and is lit where the ray hits
// material. Millimetres of the picture, Z out of the board, its surface at 0. Colours are linear light.

struct View {
  eye: vec4f, forward: vec4f, right: vec4f, up: vec4f,
  // low corner, size of a cell, thickness
  low: vec2f, cell: f32, thickness: f32,
  // cells in X and Y; thickness of copper; 1 if there is copper on the lower side too
  cells: vec2f, copper_mm: f32, both: f32,
  // tip of the tool; 1 if there is a tool
  tip: vec4f,
  // radius of its end, its largest radius, slope of its edge, length
  tool: vec4f,
  // size of the window in pixels; samples per pixel in each direction; 1 if there are cuts from below
  window: vec2f, samples: f32, under: f32,
  ground: vec4f,
}
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var depths: texture_2d<u32>;
@group(0) @binding(2) var depths_below: texture_2d<u32>;

const FAR = 1e9;
const COPPER = vec3f(0.66, 0.27, 0.10);
const LAMINATE = vec3f(0.46, 0.40, 0.17);
const EDGE = vec3f(0.33, 0.31, 0.15);
const STEEL = vec3f(0.55, 0.58, 0.62);

@vertex fn corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
  return vec4f(vec2f(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}

// Depth of a cell; outside the board everything is cut.
fn depth_of(cell: vec2i) -> f32 {
  if cell.x < 0 || cell.y < 0 || cell.x >= i32(view.cells.x) || cell.y >= i32(view.cells.y) { return FAR; }
  return f32(textureLoad(depths, cell, 0).r) * 0.001;
}

// Height of the lower face of a cell, after cuts from below.
fn bottom_of(cell: vec2i) -> f32 {
  if view.under < 0.5 { return -view.thickness; }
  return f32(textureLoad(depths_below, cell, 0).r) * 0.001 - view.thickness;
}

// The kinds of hit: nothing, a floor or slope, a wall in X or Y, the lower face, material around the eye
// itself.
const NOTHING = 0;
const FLOOR = 1;
const WALL_X = 2;
const WALL_Y = 3;
const UNDERSIDE = 4;
const INSIDE = 5;
struct Hit { t: f32, normal: vec3f, cell: vec2i, side: bool }

// Smooth normal of a floor, from the neighbouring cells.
fn floor_normal(cell: vec2i, depth: f32) -> vec3f {
  let most = 1.2 * view.cell;
  let east = clamp(depth_of(cell + vec2i(1, 0)) - depth, -most, most);
  let west = clamp(depth_of(cell - vec2i(1, 0)) - depth, -most, most);
  let north = clamp(depth_of(cell + vec2i(0, 1)) - depth, -most, most);
  let south = clamp(depth_of(cell - vec2i(0, 1)) - depth, -most, most);
  return normalize(vec3f(east - west, north - south, 2.0 * view.cell));
}

// The normal is computed after the loop: inside it, shader compilers would need most of a minute.
fn march(eye: vec3f, way: vec3f) -> Hit {
  var hit: Hit;
  hit.t = FAR;
  let low = vec3f(view.low, -view.thickness);
  let high = vec3f(view.low + view.cells * view.cell, 0.0);
  let safe = select(way, vec3f(1e-7), abs(way) < vec3f(1e-7));
  let first = (low - eye) / safe;
  let second = (high - eye) / safe;
  let enter3 = min(first, second);
  let leave3 = max(first, second);
  let enter = max(max(enter3.x, enter3.y), max(enter3.z, 0.0));
  let leave = min(min(leave3.x, leave3.y), leave3.z);
  if enter >= leave { return hit; }
  // The face through which the ray enters: a side, or the upper or lower face.
  var through = INSIDE;
  if enter == enter3.z { through = FLOOR; } else if enter == enter3.x { through = WALL_X; } else if enter == enter3.y { through = WALL_Y; }
  let start = (eye + safe * (enter + 1e-5) - low) / view.cell;
  var cell = clamp(vec2i(floor(start.xy)), vec2i(0), vec2i(view.cells) - vec2i(1));
  let stride = vec2i(sign(safe.xy));
  let step_t = abs(view.cell / safe.xy);
  let edge = view.low + (vec2f(cell) + select(vec2f(0.0), vec2f(1.0), safe.xy > vec2f(0.0))) * view.cell;
  var next = (edge - eye.xy) / safe.xy;
  var t = enter;
  var before = FAR;
  var depth = 0.0;
  var face = NOTHING;
  for (var count = 0; count < 1024; count++) {
    depth = depth_of(cell);
    let end = min(min(next.x, next.y), leave);
    let bottom = bottom_of(cell);
    if -depth > bottom {
      let at_z = eye.z + safe.z * t;
      let end_z = eye.z + safe.z * end;
      let within = at_z <= 1e-5 - depth;
      if within && at_z >= bottom - 1e-4 && through != FLOOR {
        // A low step is part of a slope, so light it as a slope.
        let slope = before - depth < 3.0 * view.cell && at_z >= -before - 1e-4;
        face = select(through, FLOOR, slope);
        break;
      }
      if safe.z > 0.0 && at_z < bottom + 1e-4 && end_z > bottom - 1e-4 {
        face = UNDERSIDE;
        t = max((bottom - eye.z) / safe.z, t);
        break;
      }
      if at_z > bottom && (end_z < -depth || within) {
        face = FLOOR;
        t = max((-depth - eye.z) / safe.z, t);
        break;
      }
    }
    if end >= leave { break; }
    before = depth;
    t = end;
    if next.x < next.y { cell.x += stride.x; next.x += step_t.x; through = WALL_X; }
    else { cell.y += stride.y; next.y += step_t.y; through = WALL_Y; }
  }
  if face == NOTHING { return hit; }
  hit.t = t;
  hit.cell = cell;
  hit.side = face == WALL_X || face == WALL_Y || face == INSIDE;
  if face == FLOOR { hit.normal = floor_normal(cell, depth); }
  if face == WALL_X { hit.normal = vec3f(-sign(safe.x), 0.0, 0.0); }
  if face == WALL_Y { hit.normal = vec3f(0.0, -sign(safe.y), 0.0); }
  if face == UNDERSIDE { hit.normal = vec3f(0.0, 0.0, -1.0); }
  return hit;
}

// The sky reflected by metal: bright above, a window on the left.
fn sky(way: vec3f) -> f32 {
  let window = smoothstep(0.72, 0.95, dot(way, normalize(vec3f(-0.55, 0.35, 0.75))));
  return 0.35 + 0.45 * clamp(way.z, 0.0, 1.0) + 0.9 * window;
}

fn lit(colour: vec3f, normal: vec3f, way: vec3f, metal: f32) -> vec3f {
  let facing = select(normal, -normal, dot(normal, way) > 0.0);
  let lamp = normalize(vec3f(-0.5, 0.45, select(0.8, -0.8, view.eye.z < 0.0)));
  let bright = 0.32 + 0.75 * max(dot(facing, lamp), 0.0);
  let shine = sky(reflect(way, facing) * vec3f(1.0, 1.0, select(1.0, -1.0, view.eye.z < 0.0)));
  return colour * mix(bright, 0.30 * bright + 0.72 * shine, metal);
}

fn matter(hit: Hit, at: vec3f, way: vec3f) -> vec3f {
  let upper = at.z > -view.copper_mm - 1e-4;
  let lower = view.both > 0.5 && at.z < -view.thickness + view.copper_mm;
  if hit.normal.z < -0.5 {
    // A face cut from below is above the copper, so it is laminate.
    let copper = lower && view.both > 0.5;
    return lit(select(LAMINATE, COPPER, copper), hit.normal, way, select(0.0, 0.6, copper));
  }
  if hit.side {
    // A wall: copper at the edges, layers of glass between, darker further down.
    let layers = 0.92 + 0.08 * sin(at.z * 55.0);
    let shade = mix(1.0, 0.6, clamp(-at.z / view.thickness, 0.0, 1.0));
    return lit(select(EDGE * layers * shade, COPPER, upper || lower), hit.normal, way, select(0.0, 0.4, upper || lower));
  }
  let depth = -at.z;
  if depth < view.copper_mm {
    // Copper, duller where the tool has scratched it.
    return lit(COPPER * select(1.0, 0.85, depth > 0.001), hit.normal, way, select(0.6, 0.3, depth > 0.001));
  }
  // Narrow, deep grooves get less light.
  let reach = 6;
  var open = 0.0;
  open += min(depth - depth_of(hit.cell + vec2i(reach, 0)), depth);
  open += min(depth - depth_of(hit.cell - vec2i(reach, 0)), depth);
  open += min(depth - depth_of(hit.cell + vec2i(0, reach)), depth);
  open += min(depth - depth_of(hit.cell - vec2i(0, reach)), depth);
  let shade = 1.0 / (1.0 + 0.9 * max(open, 0.0) / (4.0 * f32(reach) * view.cell));
  return lit(LAMINATE * shade, hit.normal, way, 0.0);
}

// Intersection with an upright cone or cylinder: radius `radius` at height `low`, growing by `grows` per mm
// up to `high`.
fn turned(eye: vec3f, way: vec3f, low: f32, high: f32, radius: f32, grows: f32) -> vec2f {
  let o = eye.xy - view.tip.xy;
  let r = radius + grows * (eye.z - low);
  let g = grows * way.z;
  let a = dot(way.xy, way.xy) - g * g;
  let b = dot(o, way.xy) - r * g;
  let c = dot(o, o) - r * r;
  let root = b * b - a * c;
  if root < 0.0 || abs(a) < 1e-9 { return vec2f(FAR, 0.0); }
  let near = min((-b - sqrt(root)) / a, (-b + sqrt(root)) / a);
  let far = max((-b - sqrt(root)) / a, (-b + sqrt(root)) / a);
  for (var k = 0; k < 2; k++) {
    let t = select(far, near, k == 0);
    let z = eye.z + t * way.z;
    if t > 0.0 && z >= low && z <= high && radius + grows * (z - low) >= 0.0 { return vec2f(t, 1.0); }
  }
  return vec2f(FAR, 0.0);
}

// Intersection with the tool: distance and normal; FAR if the ray misses it.
fn tool_hit(eye: vec3f, way: vec3f) -> vec4f {
  let tip = view.tip.z;
  let slope = view.tool.z;
  let shoulder = tip + slope * (view.tool.y - view.tool.x);
  var best = vec4f(FAR, 0.0, 0.0, 1.0);
  if slope > 0.0 {
    let cone = turned(eye, way, tip, shoulder, view.tool.x, 1.0 / slope);
    if cone.y > 0.5 && cone.x < best.x {
      let at = eye + cone.x * way;
      best = vec4f(cone.x, normalize(vec3f(normalize(at.xy - view.tip.xy), -1.0 / slope)));
    }
  }
  let shank = turned(eye, way, shoulder, tip + view.tool.w, view.tool.y, 0.0);
  if shank.y > 0.5 && shank.x < best.x {
    let at = eye + shank.x * way;
    best = vec4f(shank.x, normalize(vec3f(at.xy - view.tip.xy, 0.0)));
  }
  let top = (tip + view.tool.w - eye.z) / way.z;
  let over = eye.xy + top * way.xy - view.tip.xy;
  if top > 0.0 && top < best.x && dot(over, over) < view.tool.y * view.tool.y {
    best = vec4f(top, 0.0, 0.0, 1.0);
  }
  return best;
}

fn seen(at: vec2f) -> vec3f {
  let x = 2.0 * at.x / view.window.x - 1.0;
  let y = 1.0 - 2.0 * at.y / view.window.y;
  let way = normalize(view.forward.xyz + x * view.right.xyz + y * view.up.xyz);
  let eye = view.eye.xyz;
  var colour = view.ground.rgb * (1.0 + 0.25 * y);
  let hit = march(eye, way);
  if hit.t < FAR { colour = matter(hit, eye + hit.t * way, way); }
  if view.tip.w > 0.5 {
    let tool = tool_hit(eye, way);
    // Draw the tool translucent, so that its work stays visible.
    if tool.x < hit.t { colour = mix(colour, lit(STEEL, tool.yzw, way, 0.7), 0.62); }
  }
  return colour;
}

@fragment fn colour(@builtin(position) position: vec4f) -> @location(0) vec4f {
  let across = i32(view.samples);
  var sum = vec3f(0.0);
  for (var row = 0; row < across; row++) {
    for (var column = 0; column < across; column++) {
      let off = (vec2f(f32(column), f32(row)) + 0.5) / view.samples - 0.5;
      sum += seen(position.xy + off);
    }
  }
  return vec4f(clamp(sum / (view.samples * view.samples), vec3f(0.0), vec3f(1.0)), 1.0);
}
