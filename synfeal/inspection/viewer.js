"use strict";
/*
 * An orbiting view of a coloured mesh on a canvas: WebGL 2, no library, no network.
 *
 * synfealViewer(canvas, scene) returns {setCut, setBackFaces, setLine} or null without WebGL 2.
 *   scene.positions  base64 of int16 x y z; metres are offset_m + step_m * value, z up
 *   scene.colors    base64 of uint8 r g b, one per vertex
 *   scene.faces      base64 of uint32 triples; counter-clockwise triangles face the viewer
 *   scene.yaw        heading of the first view, radians, 0 along x
 *   scene.polylines  optional [{points: [[x, y, z], ...], color: [r, g, b]}]: metres, 0 to 255
 */
const SURFACE_VERTEX = `#version 300 es
uniform mat4 clipFromWorld; uniform vec3 offset; uniform float step;
in vec3 position; in vec3 color; out vec3 world; out vec3 tint;
void main() { world = offset + step * position; tint = color; gl_Position = clipFromWorld * vec4(world, 1.0); }`;
const SURFACE_FRAGMENT = `#version 300 es
precision highp float;
uniform float cut; in vec3 world; in vec3 tint; out vec4 pixel;
void main() {
  if (world.z > cut) discard;
  vec3 normal = normalize(cross(dFdx(world), dFdy(world)) + 1e-12);  // a little shape for plain walls
  pixel = vec4(tint * (0.86 + 0.14 * abs(dot(normal, normalize(vec3(0.3, 0.5, 0.8))))), 1.0);
}`;
const LINE_VERTEX = `#version 300 es
uniform mat4 clipFromWorld; in vec3 position;
void main() { gl_Position = clipFromWorld * vec4(position, 1.0); }`;
const LINE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 color; out vec4 pixel;
void main() { pixel = vec4(color, 1.0); }`;
const BACKGROUND = [0.93, 0.94, 0.95];
const FIELD_OF_VIEW = 0.8;

function synfealViewer(canvas, scene) {
  const gl = canvas.getContext("webgl2", { antialias: true });
  if (!gl) return null;
  const positions = new Int16Array(bytes(scene.positions));
  const colors = new Uint8Array(bytes(scene.colors));
  const faces = new Uint32Array(bytes(scene.faces));
  const bounds = boundsOf(positions, scene);
  const surface = program(gl, SURFACE_VERTEX, SURFACE_FRAGMENT);
  const line = program(gl, LINE_VERTEX, LINE_FRAGMENT);
  const mesh = gl.createVertexArray();
  gl.bindVertexArray(mesh);
  attribute(gl, surface, "position", positions, gl.SHORT, false);
  attribute(gl, surface, "color", colors, gl.UNSIGNED_BYTE, true);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
  const lines = (scene.polylines || []).map((polyline) => {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    attribute(gl, line, "position", new Float32Array(polyline.points.flat()), gl.FLOAT, false);
    const color = polyline.color.map((c) => c / 255);
    return { array, count: polyline.points.length, color, shown: true };
  });

  const home = {
    yaw: scene.yaw, pitch: 0.7, distance: 1.0 * bounds.size / FIELD_OF_VIEW, target: bounds.centre,
  };
  let view = { ...home, target: [...home.target] };
  let cut = Infinity, backFaces = false, pending = false;

  function draw() {
    pending = false;
    const scale = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * scale));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * scale));
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...BACKGROUND, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    if (backFaces) gl.disable(gl.CULL_FACE); else gl.enable(gl.CULL_FACE);
    const clipFromWorld = clipMatrix(view, canvas.width / canvas.height, bounds.size);
    gl.useProgram(surface);
    gl.uniformMatrix4fv(gl.getUniformLocation(surface, "clipFromWorld"), false, clipFromWorld);
    gl.uniform3fv(gl.getUniformLocation(surface, "offset"), scene.offset_m);
    gl.uniform1f(gl.getUniformLocation(surface, "step"), scene.step_m);
    gl.uniform1f(gl.getUniformLocation(surface, "cut"), Math.min(cut, 1e30));
    gl.bindVertexArray(mesh);
    gl.drawElements(gl.TRIANGLES, faces.length, gl.UNSIGNED_INT, 0);
    gl.useProgram(line);
    gl.uniformMatrix4fv(gl.getUniformLocation(line, "clipFromWorld"), false, clipFromWorld);
    for (const { array, count, color } of lines.filter((polyline) => polyline.shown)) {
      gl.uniform3fv(gl.getUniformLocation(line, "color"), color);
      gl.bindVertexArray(array);
      gl.drawArrays(gl.LINE_STRIP, 0, count);
    }
  }
  function redraw() {
    if (!pending) { pending = true; requestAnimationFrame(draw); }
  }
  function turn(dx, dy) {
    view.yaw -= dx;
    view.pitch = Math.max(-1.55, Math.min(1.55, view.pitch + dy));
    redraw();
  }
  function zoom(factor) {
    view.distance = Math.max(0.02 * bounds.size, Math.min(8 * bounds.size, view.distance * factor));
    redraw();
  }
  function move(dx, dy) {  // in units of the canvas height
    const { right, up } = axesOf(view), reach = view.distance * FIELD_OF_VIEW;
    view.target = view.target.map((v, i) => v - reach * (dx * right[i] - dy * up[i]));
    redraw();
  }
  listen(canvas, { turn, zoom, move, reset: () => { view = { ...home, target: [...home.target] }; redraw(); } });
  new ResizeObserver(redraw).observe(canvas);
  draw();
  return {
    bounds,
    setCut: (metres) => { cut = metres; redraw(); },
    setBackFaces: (shown) => { backFaces = shown; redraw(); },
    setLine: (index, shown) => { lines[index].shown = shown; redraw(); },
  };
}

function listen(canvas, act) {
  const pointers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  }
  canvas.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const spread = () => {
      const [a, b] = [...pointers.values()];
      return Math.hypot(a[0] - b[0], a[1] - b[1]) || 1;
    };
    const dx = event.clientX - last[0], dy = event.clientY - last[1];
    const before = pointers.size === 2 ? spread() : 1;
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (pointers.size === 2) {
      act.zoom(before / spread());
      act.move(dx / 2 / canvas.clientHeight, dy / 2 / canvas.clientHeight);
    } else if (event.shiftKey || event.buttons & 2) {
      act.move(dx / canvas.clientHeight, dy / canvas.clientHeight);
    } else act.turn(dx * 0.008, dy * 0.008);
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", act.reset);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    act.zoom(Math.exp(Math.sign(event.deltaY) * 0.12));
  }, { passive: false });
  const keys = {
    ArrowLeft: () => act.turn(0.1, 0), ArrowRight: () => act.turn(-0.1, 0),
    ArrowUp: () => act.turn(0, 0.1), ArrowDown: () => act.turn(0, -0.1),
    "+": () => act.zoom(0.9), "=": () => act.zoom(0.9), "-": () => act.zoom(1.1), Home: act.reset,
  };
  canvas.addEventListener("keydown", (event) => {
    if (!(event.key in keys) || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    keys[event.key]();
  });
}

function axesOf({ yaw, pitch }) {  // world axes of the viewer; at yaw 0 and pitch 0 it looks along x
  const [c, s, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  return { forward: [c * cp, s * cp, -sp], right: [s, -c, 0], up: [c * sp, s * sp, cp] };
}

function clipMatrix(view, aspect, size) {
  const { forward, right, up } = axesOf(view);
  const eye = view.target.map((v, i) => v - view.distance * forward[i]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const near = view.distance / 100, far = view.distance + 4 * size;
  const lens = 1 / Math.tan(FIELD_OF_VIEW / 2);  // across the shorter side of the canvas
  const fx = lens / Math.max(aspect, 1), fy = lens * Math.min(aspect, 1);
  const k = (far + near) / (far - near), t = 2 * far * near / (far - near);
  const rows = [
    [...right.map((v) => fx * v), -fx * dot(right, eye)],
    [...up.map((v) => fy * v), -fy * dot(up, eye)],
    [...forward.map((v) => k * v), -k * dot(forward, eye) - t],
    [...forward, -dot(forward, eye)],
  ];
  return new Float32Array([0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column])));
}

function boundsOf(positions, scene) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; i++) {
    const value = scene.offset_m[i % 3] + scene.step_m * positions[i];
    low[i % 3] = Math.min(low[i % 3], value);
    high[i % 3] = Math.max(high[i % 3], value);
  }
  const centre = low.map((v, i) => (v + high[i]) / 2);
  return { low, high, centre, size: Math.hypot(...low.map((v, i) => high[i] - v)) || 1 };
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}

function attribute(gl, user, name, values, type, normalised) {
  const place = gl.getAttribLocation(user, name);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, 3, type, normalised, 0, 0);
}

function bytes(base64) {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer;
}
