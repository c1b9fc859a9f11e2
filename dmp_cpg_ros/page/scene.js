// Copyright 2026 The dmp_cpg_ros authors
// SPDX-License-Identifier: Apache-2.0
// The robot and its world in WebGL 2: shapes of the model, shadows, footprints, forces.

import { COLOURS } from '/panels.js';

const FIELD = 0.62;               // field of view, half its height [rad / 2]
const SHADOW = 1024;              // texels along a side of the shadow map
const FOOTPRINTS = 60;
const SLOW = 0.12;                // time between pictures that is too long [s],
const LATE = 1;                   // and sum of such times, one after the other, that is too much [s]
const SKY = [0.42, 0.60, 0.82], HORIZON = [0.83, 0.89, 0.94];
const SUN = normal([-0.45, -0.35, 1.0]);

const VERTEX = `#version 300 es
layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 colour;
uniform mat4 view, pose, sun;
out vec3 at, up;
out vec4 tint, shade;
void main() {
  vec4 world = pose * vec4(place, 1.0);
  at = world.xyz;
  up = mat3(pose) * normal;
  tint = colour;
  shade = sun * world;
  gl_Position = view * world;
}`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2DShadow;
in vec3 at, up;
in vec4 tint, shade;
uniform vec3 eye, light, horizon;
uniform vec4 over;                // colour of a marker where its opacity is not 0
uniform float ground;             // 1: the chequered floor
uniform float far;
uniform sampler2DShadow shadows;
out vec4 result;
float lit() {
  vec3 p = shade.xyz / shade.w * 0.5 + 0.5;
  if (any(lessThan(p, vec3(0.0))) || any(greaterThan(p, vec3(1.0)))) return 1.0;
  float sum = 0.0, texel = 1.0 / ${SHADOW}.0;
  for (int i = -1; i <= 1; i++) for (int j = -1; j <= 1; j++)
    sum += texture(shadows, vec3(p.xy + vec2(i, j) * texel, p.z - 0.0015));
  return sum / 9.0;
}
void main() {
  if (over.a > 0.0) { result = over; return; }
  vec3 n = normalize(up), to_eye = normalize(eye - at);
  vec3 albedo = pow(tint.rgb, vec3(2.2));
  if (ground > 0.5) {
    vec2 cell = at.xy * 2.0, wide = fwidth(cell);
    vec2 wave = abs(fract(cell * 0.5) - 0.5) * 2.0 - 0.5;
    vec2 soft = clamp(wave / max(wide, 1e-4), -0.5, 0.5);
    float check = soft.x * soft.y * 2.0 + 0.5, blur = clamp(1.0 - max(wide.x, wide.y), 0.0, 1.0);
    albedo = mix(vec3(0.335), mix(vec3(0.29), vec3(0.385), check), blur);
  }
  float sunny = max(dot(n, light), 0.0) * lit();
  float sky = 0.5 + 0.5 * n.z;
  float shine = pow(max(dot(n, normalize(light + to_eye)), 0.0), 40.0) * (ground > 0.5 ? 0.0 : 0.25);
  vec3 ambient = mix(vec3(0.20, 0.19, 0.18), vec3(0.44, 0.49, 0.56), sky);
  vec3 colour = albedo * (ambient + sunny * vec3(1.02, 0.97, 0.88)) + shine * sunny;
  colour = mix(colour, albedo * 1.4, tint.a);                       // what glows by itself
  float fog = smoothstep(0.25, 1.0, length(at.xy - eye.xy) / far);
  result = vec4(mix(pow(colour, vec3(1.0 / 2.2)), horizon, fog), 1.0);
}`;

const SKY_VERTEX = `#version 300 es
uniform vec3 ahead, right, above;
out vec3 way;
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  way = ahead + corner.x * right + corner.y * above;
  gl_Position = vec4(corner, 1.0, 1.0);
}`;

const SKY_FRAGMENT = `#version 300 es
precision highp float;
in vec3 way;
uniform vec3 horizon, zenith;
out vec4 result;
void main() {
  result = vec4(mix(horizon, zenith, smoothstep(0.0, 0.55, normalize(way).z)), 1.0);
}`;

const SHADOW_FRAGMENT = `#version 300 es
precision highp float;
void main() {}`;

// --- vectors and matrices (columns, as WebGL has them) ------------------------------------------

function add(a, b, factor = 1) { return a.map((value, i) => value + factor * b[i]); }
function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}
function normal(a) { const length = Math.hypot(...a) || 1; return a.map((value) => value / length); }

function product(a, b) {
  const c = new Float32Array(16);
  for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++)
    for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return c;
}

function looking(eye, at) {
  const z = normal(add(eye, at, -1)), x = normal(cross([0, 0, 1], z)), y = cross(z, x);
  return new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0,
    -dot(x, eye), -dot(y, eye), -dot(z, eye), 1]);
}

function perspective(aspect, near, far) {
  const f = 1 / Math.tan(FIELD / 2);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1,
    0, 0, 2 * far * near / (near - far), 0]);
}

function parallel(half, depth) {
  return new Float32Array([1 / half, 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, -2 / depth, 0, 0, 0, -1, 1]);
}

/** Rotation of a quaternion (w, x, y, z), as rows. */
function rotation([w, x, y, z]) {
  return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]];
}

function matrix(place, rows, scale = [1, 1, 1]) {
  const m = new Float32Array(16);
  for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) m[4 * j + i] = rows[i][j] * scale[j];
  m.set(place, 12);
  m[15] = 1;
  return m;
}

const STILL = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

// --- shapes as triangles: corners and normals, nine and nine numbers each ------------------------

/** A surface of revolution about z from a profile of (radius, height, normal's r and z). */
function revolved(profile, around = 20) {
  const corners = [], normals = [];
  const at = ([r, z], angle) => [r * Math.cos(angle), r * Math.sin(angle), z];
  for (let i = 1; i < profile.length; i++) {
    for (let k = 0; k < around; k++) {
      const a = 2 * Math.PI * k / around, b = 2 * Math.PI * (k + 1) / around;
      for (const [p, angle] of [[profile[i - 1], a], [profile[i - 1], b], [profile[i], b],
        [profile[i - 1], a], [profile[i], b], [profile[i], a]]) {
        corners.push(at(p, angle));
        normals.push(at(p.slice(2), angle));
      }
    }
  }
  return { corners, normals };
}

function ball(radius, [low, high], shift = 0, rings = 12) {
  const profile = [];
  for (let i = 0; i <= rings; i++) {
    const angle = low + (high - low) * i / rings, r = Math.cos(angle), z = Math.sin(angle);
    profile.push([radius * r, radius * z + shift, r, z]);
  }
  return profile;
}

function tube(radius, half) {
  return revolved([[0, -half, 0, -1], [radius, -half, 0, -1], [radius, -half, 1, 0],
    [radius, half, 1, 0], [radius, half, 0, 1], [0, half, 0, 1]]);
}

function box([x, y, z]) {
  const corners = [], normals = [];
  for (let axis = 0; axis < 3; axis++) for (const sign of [-1, 1]) {
    const half = [x, y, z], n = [0, 0, 0], u = (axis + 1) % 3, v = (axis + 2) % 3;
    n[axis] = sign;
    const corner = (a, b) => { const c = [0, 0, 0]; c[axis] = sign * half[axis]; c[u] = a * half[u]; c[v] = b * half[v]; return c; };
    const four = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
    for (const i of sign > 0 ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2]) {
      corners.push(four[i]);
      normals.push(n);
    }
  }
  return { corners, normals };
}

function numbers(text, kind) {
  return new kind(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
}

function mesh({ corners, faces }) {
  const points = numbers(corners, Float32Array), found = { corners: [], normals: [] };
  const triangles = numbers(faces, Int32Array);
  for (let i = 0; i < triangles.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => [...points.subarray(3 * triangles[i + k], 3 * triangles[i + k] + 3)]);
    const n = normal(cross(add(b, a, -1), add(c, a, -1)));
    found.corners.push(a, b, c);
    found.normals.push(n, n, n);
  }
  return found;
}

function triangles(shape, meshes) {
  const [a, b, c] = shape.size, half = Math.PI / 2;
  switch (shape.kind) {
    case 'box': return box(shape.size);
    case 'sphere': return revolved(ball(a, [-half, half]));
    case 'capsule': return revolved([...ball(a, [-half, 0], -b, 6), ...ball(a, [0, half], b, 6)]);
    case 'cylinder': return tube(a, b);
    case 'mesh': return mesh(meshes[shape.mesh]);
    case 'ellipsoid': {
      const found = revolved(ball(1, [-half, half]));
      found.normals = found.corners.map(([x, y, z]) => normal([x / a, y / b, z / c]));
      found.corners = found.corners.map(([x, y, z]) => [a * x, b * y, c * z]);
      return found;
    }
    default: return null;
  }
}

// --- the view --------------------------------------------------------------------------------------

export class View {
  /** Draw on a canvas; throws when the browser has no WebGL 2. */
  constructor(canvas) {
    this.canvas = canvas;
    const gl = this.gl = canvas.getContext('webgl2', { antialias: true, alpha: false });
    if (!gl) throw new Error('This browser has no WebGL 2: the panels work, the robot is not drawn.');
    this.camera = { azimuth: 2.35, elevation: 0.30, distance: 3 };
    this.target = null;
    this.footprints = [];
    this.down = [true, true, true, true];
    this.push = null;
    this.quality = 1;
    this.late = 0;
    this.solid = this._program(VERTEX, FRAGMENT);
    this.dark = this._program(VERTEX, SHADOW_FRAGMENT);
    this.sky = this._program(SKY_VERTEX, SKY_FRAGMENT);
    this.parts = [];
    this.floor = this._buffers(box([400, 400, 0.001]), [1, 1, 1, 0]);
    this.stem = this._buffers(tube(1, 1), [1, 1, 1, 0]);
    this.tip = this._buffers(revolved([[0, 0, 0, -1], [1, 0, 0, -1], [1, 0, 0.9, 0.4], [0, 1, 0.9, 0.4]]),
      [1, 1, 1, 0]);
    this._make_shadows();
    gl.enable(gl.DEPTH_TEST);
  }

  /** Take what is drawn: one buffer for each body. */
  load(scene) {
    this.scene = scene;
    this.floor_height = null;
    const bodies = new Map();
    for (const shape of scene.shapes) {
      if (shape.kind === 'plane') { this.floor_height = shape.place[2]; continue; }
      const found = triangles(shape, scene.meshes);
      if (!found) continue;
      if (!bodies.has(shape.body)) bodies.set(shape.body, []);
      const turn = rotation(shape.quaternion), data = bodies.get(shape.body);
      const turned = (p) => turn.map((row) => dot(row, p));
      found.corners.forEach((corner, i) => data.push(...add(turned(corner), shape.place),
        ...turned(found.normals[i]), ...shape.colour.slice(0, 3), Math.min(1, shape.glow)));
    }
    this.parts = [...bodies].map(([body, data]) => ({ body, ...this._upload(new Float32Array(data)) }));
    this.camera.distance = 5.2 * scene.height;
  }

  /** Take a frame; remembers where feet came down. */
  take(frame) {
    this.frame = frame;
    this.base = frame.bodies[this.scene.base];
    if (!this.target || Math.hypot(...add(this.target, this.base.slice(0, 3), -1)) > 2) this.target = this.base.slice(0, 3);
    (frame.load || []).forEach((load, i) => {
      const down = load > 1;
      if (down && !this.down[i]) {
        const [x, y, z] = frame.feet[i];
        this.footprints.push({ leg: i, place: [x, y, z - this.scene.feet[i] + 0.003] });
        if (this.footprints.length > FOOTPRINTS) this.footprints.shift();
      }
      this.down[i] = down;
    });
  }

  /** Draw; dt is the time since the last picture [s]. */
  draw(dt) {
    const gl = this.gl, canvas = this.canvas;
    this._spare(dt);
    const dense = this.quality * Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * dense), height = Math.round(canvas.clientHeight * dense);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    if (this.base) {
      const follow = 1 - Math.exp(-6 * Math.min(0.5, dt));
      this.target = add(this.target, add(this.base.slice(0, 3), this.target, -1), follow);
    }
    const eye = this._eye(), at = this._at(), aspect = width / Math.max(1, height), far = 60;
    const view = product(perspective(aspect, 0.02, 4 * far), looking(eye, at));
    const sun = product(parallel(2.2 * this._size(), 12 * this._size()),
      looking(add(at, SUN, 6 * this._size()), at));
    this._draw_shadows(sun);
    gl.viewport(0, 0, width, height);
    this._draw_sky(eye, at, aspect);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    const solid = this.solid;
    gl.useProgram(solid.program);
    gl.uniformMatrix4fv(solid.view, false, view);
    gl.uniformMatrix4fv(solid.sun, false, sun);
    gl.uniform3fv(solid.eye, eye);
    gl.uniform3fv(solid.light, SUN);
    gl.uniform3fv(solid.horizon, HORIZON);
    gl.uniform1f(solid.far, far);
    gl.uniform4f(solid.over, 0, 0, 0, 0);
    if (this.floor_height !== null) {
      gl.uniform1f(solid.ground, 1);
      this._part(solid, this.floor, matrix([Math.round(at[0]), Math.round(at[1]), this.floor_height - 0.001], STILL));
      gl.uniform1f(solid.ground, 0);
    }
    for (const part of this.parts) this._part(solid, part, this._pose(part.body));
    if (this.frame) this._draw_markers(solid);
  }

  /** Draw fewer points where pictures take long: without a graphics processor, for instance. */
  _spare(dt) {
    if (this.width !== this.canvas.clientWidth) [this.quality, this.late, this.width] = [1, 0, this.canvas.clientWidth];
    this.late = dt > SLOW ? this.late + dt : 0;
    if (this.late > LATE && this.quality > 0.4) [this.quality, this.late] = [this.quality * 0.7, 0];
  }

  /** Where on the robot a point of the canvas is, as a ray hits it; null beside the robot. */
  robot_at(x, y) {
    if (!this.frame) return null;
    const eye = this._eye(), [ahead, right, above] = this._axes();
    const u = 2 * x / this.canvas.clientWidth - 1, v = 1 - 2 * y / this.canvas.clientHeight;
    const t = Math.tan(FIELD / 2), aspect = this.canvas.clientWidth / this.canvas.clientHeight;
    const way = normal(add(add(ahead, right, u * t * aspect), above, v * t));
    const near = (body, reach) => {
      const from = add(body.slice(0, 3), eye, -1), along = dot(from, way);
      return along > 0 && Math.hypot(...add(from, way, -along)) < reach;
    };
    const hit = this.frame.bodies.some((body, i) => i > 0 &&
      near(body, this.scene.height * (i === this.scene.base ? 0.55 : 0.22)));
    return hit ? this.base.slice(0, 3) : null;
  }

  /** A drag over the canvas [pixels] as a vector over the ground at the robot's distance [m]. */
  ground_drag(dx, dy) {
    const [, right] = this._axes(), ahead = normal(cross([0, 0, 1], right));
    const metres = 2 * Math.tan(FIELD / 2) * this.camera.distance / this.canvas.clientHeight;
    return add(right.map((value) => value * dx * metres), ahead, -dy * metres);
  }

  turn(dx, dy) {
    this.camera.azimuth -= 0.008 * dx;
    this.camera.elevation = Math.min(1.5, Math.max(0.02, this.camera.elevation + 0.006 * dy));
  }

  zoom(factor) {
    this.camera.distance = Math.min(40 * this._size(), Math.max(1.2 * this._size(), this.camera.distance * factor));
  }

  _size() { return this.scene ? this.scene.height : 0.3; }

  _at() { return this.target ? add(this.target, [0, 0, -0.25 * this._size()]) : [0, 0, 0.2]; }

  _eye() {
    const { azimuth, elevation, distance } = this.camera, flat = distance * Math.cos(elevation);
    return add(this._at(), [-flat * Math.cos(azimuth), -flat * Math.sin(azimuth), distance * Math.sin(elevation)]);
  }

  /** Directions ahead, to the right and upwards in the picture. */
  _axes() {
    const ahead = normal(add(this._at(), this._eye(), -1)), right = normal(cross(ahead, [0, 0, 1]));
    return [ahead, right, cross(right, ahead)];
  }

  _pose(body) {
    const pose = this.frame && this.frame.bodies[body];
    return pose ? matrix(pose.slice(0, 3), rotation(pose.slice(3))) : matrix([0, 0, 0], STILL);
  }

  _part(program, part, pose) {
    const gl = this.gl;
    gl.uniformMatrix4fv(program.pose, false, pose);
    gl.bindVertexArray(part.array);
    gl.drawArrays(gl.TRIANGLES, 0, part.count);
  }

  _draw_markers(solid) {
    const gl = this.gl, size = this._size(), weight = 9.81 * this.scene.mass;
    const mark = (part, colour, opacity, pose) => {
      gl.uniform4f(solid.over, ...colour, opacity);
      this._part(solid, part, pose);
    };
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    this.footprints.forEach(({ leg, place }, i) => mark(
      this.stem, rgb(COLOURS[this.scene.legs[leg]]), 0.25 + 0.5 * (i + 1) / this.footprints.length,
      matrix(place, STILL, [0.075 * size, 0.075 * size, 0.001])));
    gl.depthMask(true);
    (this.frame.load || []).forEach((load, i) => {
      if (load > 1) {
        const [x, y, z] = this.frame.feet[i];
        this._arrow(mark, [x, y, z - this.scene.feet[i]], [0, 0, 1], 1.1 * size * load / weight,
          rgb(COLOURS[this.scene.legs[i]]), 0.85);
      }
    });
    if (this.push) {
      const length = Math.hypot(...this.push);
      gl.disable(gl.DEPTH_TEST);  // it begins inside the robot
      if (length > 0) this._arrow(mark, this.base.slice(0, 3), normal(this.push),
        1.6 * size * length / weight + 0.4 * size, [1, 0.22, 0.25], 0.9, 1.6);
      gl.enable(gl.DEPTH_TEST);
    }
    gl.uniform4f(solid.over, 0, 0, 0, 0);
    gl.disable(gl.BLEND);
  }

  _arrow(mark, from, way, length, colour, opacity, thick = 1) {
    const size = this._size(), side = normal(Math.abs(way[2]) < 0.9 ? cross(way, [0, 0, 1]) : [1, 0, 0]);
    const other = cross(way, side), rows = [0, 1, 2].map((i) => [side[i], other[i], way[i]]);
    const head = Math.min(0.14 * size * thick, 0.6 * length), half = (length - head) / 2;
    const wide = 0.018 * size * thick;
    mark(this.stem, colour, opacity, matrix(add(from, way, half), rows, [wide, wide, half]));
    mark(this.tip, colour, opacity, matrix(add(from, way, length - head), rows, [2.8 * wide, 2.8 * wide, head]));
  }

  _draw_sky(eye, at, aspect) {
    const gl = this.gl, sky = this.sky, t = Math.tan(FIELD / 2), [ahead, right, above] = this._axes();
    gl.useProgram(sky.program);
    gl.uniform3fv(sky.ahead, ahead);
    gl.uniform3fv(sky.right, right.map((value) => value * t * aspect));
    gl.uniform3fv(sky.above, above.map((value) => value * t));
    gl.uniform3fv(sky.horizon, HORIZON);
    gl.uniform3fv(sky.zenith, SKY);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(null);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.DEPTH_TEST);
  }

  _make_shadows() {
    const gl = this.gl;
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.DEPTH_COMPONENT24, SHADOW, SHADOW, 0, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, null);
    for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
      [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
      [gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE], [gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL]])
      gl.texParameteri(gl.TEXTURE_2D, name, value);
    this.shadows = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadows);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.texture, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  _draw_shadows(sun) {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadows);
    gl.viewport(0, 0, SHADOW, SHADOW);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.useProgram(this.dark.program);
    gl.uniformMatrix4fv(this.dark.view, false, sun);
    for (const part of this.parts) this._part(this.dark, part, this._pose(part.body));
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  _buffers({ corners, normals }, colour) {
    return this._upload(new Float32Array(corners.flatMap((corner, i) => [...corner, ...normals[i], ...colour])));
  }

  _upload(data) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    for (const [place, count, offset] of [[0, 3, 0], [1, 3, 12], [2, 4, 24]]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, count, gl.FLOAT, false, 40, offset);
    }
    gl.bindVertexArray(null);
    return { array, count: data.length / 10 };
  }

  _program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    const found = { program };
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
      const { name } = gl.getActiveUniform(program, i);
      found[name] = gl.getUniformLocation(program, name);
    }
    return found;
  }
}

function rgb(text) {
  return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);
}
