"use strict";
// Reads a glTF 2.0 binary file (GLB): chunks, accessors, nodes, animations; and the arithmetic of poses.

const PARTS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 };
const ARRAYS = {
  5120: Int8Array, 5121: Uint8Array, 5122: Int16Array, 5123: Uint16Array, 5125: Uint32Array,
  5126: Float32Array,
};
const LARGEST = { 5120: 127, 5121: 255, 5122: 32767, 5123: 65535, 5125: 4294967295, 5126: 1 };

// Matrices are sixteen numbers, column by column.
function product(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column += 1) {
    for (let row = 0; row < 4; row += 1) {
      let sum = 0;
      for (let k = 0; k < 4; k += 1) sum += a[4 * k + row] * b[4 * column + k];
      out[4 * column + row] = sum;
    }
  }
  return out;
}

function transform(t, [x, y, z, w], s) {
  return new Float32Array([
    s[0] * (1 - 2 * (y * y + z * z)), s[0] * 2 * (x * y + z * w), s[0] * 2 * (x * z - y * w), 0,
    s[1] * 2 * (x * y - z * w), s[1] * (1 - 2 * (x * x + z * z)), s[1] * 2 * (y * z + x * w), 0,
    s[2] * 2 * (x * z + y * w), s[2] * 2 * (y * z - x * w), s[2] * (1 - 2 * (x * x + y * y)), 0,
    t[0], t[1], t[2], 1,
  ]);
}

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((v) => v / n); };

// From one rotation to another at an even speed, the shorter way.
function turned(a, b, share) {
  const along = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  const sign = along < 0 ? -1 : 1;
  const angle = Math.acos(Math.min(Math.abs(along), 1));
  const [from, to] = angle < 1e-4
    ? [1 - share, share]
    : [Math.sin((1 - share) * angle) / Math.sin(angle), Math.sin(share * angle) / Math.sin(angle)];
  const out = a.map((v, i) => from * v + sign * to * b[i]);
  const length = Math.hypot(...out) || 1;
  return out.map((v) => v / length);
}

function readGlb(bytes) {
  const words = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (words.getUint32(0, true) !== 0x46546c67) throw new Error("this is not a GLB file");
  const length = words.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + length)));
  return { json, bin: bytes.subarray(28 + length) };
}

// The bytes of a buffer view.
function viewBytes(gltf, index) {
  const { byteOffset = 0, byteLength } = gltf.json.bufferViews[index];
  return gltf.bin.subarray(byteOffset, byteOffset + byteLength);
}

// The elements of an accessor as lists of numbers.
function elements(gltf, index) {
  const accessor = gltf.json.accessors[index];
  const parts = PARTS[accessor.type];
  const Kind = ARRAYS[accessor.componentType];
  const stride = gltf.json.bufferViews[accessor.bufferView].byteStride || parts * Kind.BYTES_PER_ELEMENT;
  const bytes = viewBytes(gltf, accessor.bufferView).slice(accessor.byteOffset || 0);
  const full = accessor.normalized ? LARGEST[accessor.componentType] : 1;
  return Array.from({ length: accessor.count }, (_, i) =>
    Array.from(new Kind(bytes.buffer, i * stride, parts), (v) => Math.max(v / full, accessor.normalized ? -1 : -Infinity)));
}

// One property of one node over time.
function channelOf(gltf, animation, channel) {
  const sampler = animation.samplers[channel.sampler];
  return {
    node: channel.target.node,
    path: channel.target.path,
    step: sampler.interpolation === "STEP",
    times: elements(gltf, sampler.input).map(([t]) => t),
    values: elements(gltf, sampler.output),
  };
}

function valueAt(channel, time) {
  const { times, values } = channel;
  let low = 0;
  let high = times.length - 1;
  if (time <= times[0]) return values[0];
  if (time >= times[high]) return values[high];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle; else high = middle;
  }
  if (channel.step) return values[low];
  const share = (time - times[low]) / (times[high] - times[low]);
  if (channel.path === "rotation") return turned(values[low], values[high], share);
  return values[low].map((v, i) => v + share * (values[high][i] - v));
}

// The nodes of the file; each comes after its parent in `order`.
function readNodes(json) {
  const nodes = json.nodes.map((node) => ({
    rest: {
      translation: node.translation || [0, 0, 0],
      rotation: node.rotation || [0, 0, 0, 1],
      scale: node.scale || [1, 1, 1],
    },
    matrix: node.matrix && new Float32Array(node.matrix),
    children: node.children || [],
    mesh: node.mesh,
    skin: node.skin,
    parent: -1,
  }));
  nodes.forEach((node, at) => node.children.forEach((child) => { nodes[child].parent = at; }));
  const order = [];
  const visit = (at) => { order.push(at); nodes[at].children.forEach(visit); };
  nodes.forEach((node, at) => { if (node.parent < 0) visit(at); });
  return { nodes, order };
}
