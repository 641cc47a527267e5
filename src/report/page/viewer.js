// Draws one animated glTF 2.0 binary file (GLB) with WebGL 2: triangles, base colour factor and
// texture, skins of four joints a vertex, animations of nodes (LINEAR and STEP). Morph targets,
// other material channels and extensions are not drawn.

const FIELD_OF_VIEW = 20 * Math.PI / 180;
const MARGIN = 1.12;
const SIDE = { yaw: 0, pitch: 0.06, zoom: 1 };

const RIG_VERTICES = `#version 300 es
in vec3 position; in vec3 normal; in vec2 texcoord; in vec4 joints; in vec4 weights;
uniform mat4 model, view, projection;
uniform highp sampler2D jointMatrices;
uniform bool skinned;
out vec3 seen; out vec3 bent; out vec2 place;
mat4 joint(float index) {
  int row = int(index);
  return mat4(texelFetch(jointMatrices, ivec2(0, row), 0), texelFetch(jointMatrices, ivec2(1, row), 0),
              texelFetch(jointMatrices, ivec2(2, row), 0), texelFetch(jointMatrices, ivec2(3, row), 0));
}
void main() {
  // A skinned mesh goes with its joints alone: the transform of its node does not count.
  mat4 world = skinned
    ? weights.x * joint(joints.x) + weights.y * joint(joints.y) + weights.z * joint(joints.z) + weights.w * joint(joints.w)
    : model;
  vec4 at = view * world * vec4(position, 1.0);
  seen = at.xyz;
  bent = mat3(view) * mat3(world) * normal;
  place = texcoord;
  gl_Position = projection * at;
}`;

const RIG_PIXELS = `#version 300 es
precision highp float;
in vec3 seen; in vec3 bent; in vec2 place;
uniform vec4 colour; uniform sampler2D image; uniform bool textured, hasNormals; uniform float cutoff;
out vec4 pixel;
void main() {
  vec4 base = colour;
  if (textured) {
    vec4 texel = texture(image, place);
    base *= vec4(pow(texel.rgb, vec3(2.2)), texel.a);
  }
  if (base.a < cutoff) discard;
  vec3 n = normalize(hasNormals ? bent : cross(dFdx(seen), dFdy(seen)));
  if (dot(n, seen) > 0.0) n = -n;
  float light = 0.38 + 0.22 * n.y + 0.62 * max(dot(n, normalize(vec3(-0.4, 0.7, 0.6))), 0.0);
  pixel = vec4(pow(base.rgb * light, vec3(1.0 / 2.2)), 1.0);
}`;

const GROUND_VERTICES = `#version 300 es
in vec3 position;
uniform mat4 view, projection; uniform vec3 middle; uniform float size;
out vec2 place; out vec2 away;
void main() {
  away = position.xz;
  vec3 at = middle + size * vec3(position.x, 0.0, position.z);
  place = at.xz;
  gl_Position = projection * view * vec4(at, 1.0);
}`;

const GROUND_PIXELS = `#version 300 es
precision highp float;
in vec2 place; in vec2 away;
uniform vec2 shift; uniform float spacing; uniform vec3 ink;
out vec4 pixel;
void main() {
  vec2 cell = (place + shift) / spacing;
  vec2 near = abs(fract(cell - 0.5) - 0.5) / fwidth(cell);
  float line = 1.0 - min(min(near.x, near.y), 1.0);
  float alpha = 0.5 * line * clamp(1.0 - length(away), 0.0, 1.0);
  pixel = vec4(ink * alpha, alpha);
}`;

function program(gl, vertices, pixels) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertices], [gl.FRAGMENT_SHADER, pixels]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  ["position", "normal", "texcoord", "joints", "weights"].forEach((name, at) => gl.bindAttribLocation(made, at, name));
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) || "the shaders do not link");
  const uniform = {};
  const count = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS);
  for (let i = 0; i < count; i += 1) {
    const { name } = gl.getActiveUniform(made, i);
    uniform[name] = gl.getUniformLocation(made, name);
  }
  return { made, uniform };
}

class RigViewer {
  // `rig` says where to look: low, high (corners of the room), forward, heading, ground_speed, follow.
  constructor(canvas, bytes, rig) {
    this.canvas = canvas;
    this.rig = rig;
    this.gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    if (!this.gl) throw new Error("this browser has no WebGL 2");
    this.gltf = readGlb(bytes);
    Object.assign(this, readNodes(this.gltf.json));
    const animation = (this.gltf.json.animations || [])[0] || { channels: [], samplers: [] };
    this.channels = animation.channels.map((c) => channelOf(this.gltf, animation, c));
    this.skins = (this.gltf.json.skins || []).map((skin) => this.readSkin(skin));
    this.plain = program(this.gl, RIG_VERTICES, RIG_PIXELS);
    this.ground = program(this.gl, GROUND_VERTICES, GROUND_PIXELS);
    this.square = this.vertexArray([[0, 3, this.gl.FLOAT, false, 0, 0,
      this.buffer(this.gl.ARRAY_BUFFER, new Float32Array([-1, 0, -1, 1, 0, -1, -1, 0, 1, 1, 0, 1]))]]);
    this.textures = new Map();
    this.meshes = (this.gltf.json.meshes || []).map((mesh) => mesh.primitives.map((p) => this.readPrimitive(p)));
    this.look = { ...SIDE };
    this.start = this.followed(this.worlds(0));
  }

  buffer(target, data) {
    const made = this.gl.createBuffer();
    this.gl.bindBuffer(target, made);
    this.gl.bufferData(target, data, this.gl.STATIC_DRAW);
    return made;
  }

  vertexArray(attributes) {
    const { gl } = this;
    const made = gl.createVertexArray();
    gl.bindVertexArray(made);
    for (const [location, parts, kind, normalized, stride, offset, buffer] of attributes) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, parts, kind, normalized, stride, offset);
    }
    return made;
  }

  readSkin(skin) {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return { joints: skin.joints, inverse: elements(this.gltf, skin.inverseBindMatrices), texture };
  }

  readPrimitive(primitive) {
    const { gl, gltf } = this;
    const names = { POSITION: 0, NORMAL: 1, TEXCOORD_0: 2, JOINTS_0: 3, WEIGHTS_0: 4 };
    const attributes = Object.keys(names).filter((n) => n in primitive.attributes).map((name) => {
      const accessor = gltf.json.accessors[primitive.attributes[name]];
      const data = this.buffer(gl.ARRAY_BUFFER, viewBytes(gltf, accessor.bufferView));
      const stride = gltf.json.bufferViews[accessor.bufferView].byteStride || 0;
      return [names[name], PARTS[accessor.type], accessor.componentType, accessor.normalized || false, stride, accessor.byteOffset || 0, data];
    });
    const array = this.vertexArray(attributes);
    const indices = gltf.json.accessors[primitive.indices];
    this.buffer(gl.ELEMENT_ARRAY_BUFFER, viewBytes(gltf, indices.bufferView));
    gl.bindVertexArray(null);
    const material = (gltf.json.materials || [])[primitive.material] || {};
    const metallic = material.pbrMetallicRoughness || {};
    return {
      array,
      count: indices.count,
      kind: indices.componentType,
      offset: indices.byteOffset || 0,
      hasNormals: "NORMAL" in primitive.attributes,
      skinned: "JOINTS_0" in primitive.attributes,
      colour: metallic.baseColorFactor || [1, 1, 1, 1],
      cutoff: material.alphaMode === "MASK" ? material.alphaCutoff ?? 0.5 : 0,
      texture: metallic.baseColorTexture && this.readTexture(metallic.baseColorTexture.index),
    };
  }

  // A texture that is filled as soon as the browser has decoded it; the picture is then drawn again.
  readTexture(index) {
    if (this.textures.has(index)) return this.textures.get(index);
    const { gl, gltf } = this;
    const texture = { ready: false, made: gl.createTexture() };
    this.textures.set(index, texture);
    const image = gltf.json.images[gltf.json.textures[index].source];
    const blob = new Blob([viewBytes(gltf, image.bufferView)], { type: image.mimeType });
    createImageBitmap(blob, { premultiplyAlpha: "none", colorSpaceConversion: "none" }).then((bitmap) => {
      gl.bindTexture(gl.TEXTURE_2D, texture.made);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
      gl.generateMipmap(gl.TEXTURE_2D);
      texture.ready = true;
      this.draw(this.time || 0);
    }, () => {});
    return texture;
  }

  // The matrix of every node from its own space to the world's.
  worlds(time) {
    const local = this.nodes.map((node) => ({ ...node.rest }));
    const moved = new Set();
    for (const channel of this.channels) {
      if (!(channel.path in local[channel.node])) continue;
      local[channel.node][channel.path] = valueAt(channel, time);
      moved.add(channel.node);
    }
    const worlds = [];
    for (const at of this.order) {
      const node = this.nodes[at];
      const { translation, rotation, scale } = local[at];
      const own = node.matrix && !moved.has(at) ? node.matrix : transform(translation, rotation, scale);
      worlds[at] = node.parent < 0 ? own : product(worlds[node.parent], own);
    }
    return worlds;
  }

  followed(worlds) {
    const world = this.rig.follow === null ? null : worlds[this.rig.follow];
    return world ? [world[12], 0, world[14]] : [0, 0, 0];
  }

  // The camera's matrices; `moved` is how far the followed node has gone.
  camera(moved) {
    const { low, high, heading } = this.rig;
    const right = unit([heading * this.rig.forward[0], 0, heading * this.rig.forward[2]]);
    const towards = cross(right, [0, 1, 0]);
    const { yaw, pitch, zoom } = this.look;
    const flat = right.map((v, i) => Math.sin(yaw) * v + Math.cos(yaw) * towards[i]);
    const back = unit(flat.map((v, i) => Math.cos(pitch) * v + (i === 1 ? Math.sin(pitch) : 0)));
    const middle = low.map((v, i) => (v + high[i]) / 2 + moved[i]);
    const half = low.map((v, i) => (high[i] - v) / 2);
    const wide = Math.abs(right[0]) * half[0] + Math.abs(right[2]) * half[2];
    const deep = Math.abs(towards[0]) * half[0] + Math.abs(towards[2]) * half[2];
    const aspect = this.canvas.width / this.canvas.height;
    const slope = Math.tan(FIELD_OF_VIEW / 2);
    const distance = (MARGIN * Math.max(half[1] / slope, wide / slope / aspect) + deep) * zoom;
    const eye = middle.map((v, i) => v + distance * back[i]);
    const x = unit(cross([0, 1, 0], back));
    const y = cross(back, x);
    const view = new Float32Array([
      x[0], y[0], back[0], 0, x[1], y[1], back[1], 0, x[2], y[2], back[2], 0,
      -dot(x, eye), -dot(y, eye), -dot(back, eye), 1,
    ]);
    const radius = Math.hypot(...half) * 6;
    const near = Math.max(distance - radius, distance / 100);
    const far = distance + radius;
    const projection = new Float32Array([
      1 / slope / aspect, 0, 0, 0, 0, 1 / slope, 0, 0,
      0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0,
    ]);
    return { view, projection, middle, radius };
  }

  // Draws the rig at a time of its animation, seconds.
  draw(time) {
    const { gl, canvas, plain } = this;
    this.time = time;
    const worlds = this.worlds(time);
    const at = this.followed(worlds);
    const seen = this.camera(at.map((v, i) => v - this.start[i]));
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.useProgram(plain.made);
    gl.uniformMatrix4fv(plain.uniform.view, false, seen.view);
    gl.uniformMatrix4fv(plain.uniform.projection, false, seen.projection);
    gl.uniform1i(plain.uniform.jointMatrices, 1);
    this.skins.forEach((skin) => this.pose(skin, worlds));
    this.nodes.forEach((node, index) => {
      if (node.mesh !== undefined) this.meshes[node.mesh].forEach((p) => this.drawPrimitive(p, node, worlds[index]));
    });
    this.drawGround(seen, time);
  }

  // Puts the matrices of a skin's joints into its texture, one a row.
  pose(skin, worlds) {
    const { gl } = this;
    const data = new Float32Array(16 * skin.joints.length);
    skin.joints.forEach((joint, row) => data.set(product(worlds[joint], skin.inverse[row]), 16 * row));
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, skin.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 4, skin.joints.length, 0, gl.RGBA, gl.FLOAT, data);
    gl.activeTexture(gl.TEXTURE0);
  }

  drawPrimitive(primitive, node, world) {
    const { gl, plain: { uniform } } = this;
    const skinned = primitive.skinned && node.skin !== undefined;
    if (skinned) {
      gl.activeTexture(gl.TEXTURE1);
      gl.bindTexture(gl.TEXTURE_2D, this.skins[node.skin].texture);
    }
    const textured = Boolean(primitive.texture && primitive.texture.ready);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, textured ? primitive.texture.made : null);
    gl.uniform1i(uniform.image, 0);
    gl.uniform1i(uniform.textured, textured);
    gl.uniform1i(uniform.skinned, skinned);
    gl.uniform1i(uniform.hasNormals, primitive.hasNormals);
    gl.uniform1f(uniform.cutoff, primitive.cutoff);
    gl.uniform4fv(uniform.colour, primitive.colour);
    gl.uniformMatrix4fv(uniform.model, false, world);
    gl.bindVertexArray(primitive.array);
    gl.drawElements(gl.TRIANGLES, primitive.count, primitive.kind, primitive.offset);
    gl.bindVertexArray(null);
  }

  // A grid that stands still below an animal that travels, and passes below one that stays.
  drawGround({ view, projection, middle, radius }, time) {
    const { gl, ground: { made, uniform }, rig } = this;
    gl.useProgram(made);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    const way = rig.ground_speed * time;
    gl.uniformMatrix4fv(uniform.view, false, view);
    gl.uniformMatrix4fv(uniform.projection, false, projection);
    gl.uniform3f(uniform.middle, middle[0], rig.low[1], middle[2]);
    gl.uniform1f(uniform.size, radius / 3);
    gl.uniform1f(uniform.spacing, (rig.high[1] - rig.low[1]) / 3 || 1);
    gl.uniform2f(uniform.shift, way * rig.forward[0], way * rig.forward[2]);
    gl.uniform3f(uniform.ink, 0.5, 0.55, 0.6);
    gl.bindVertexArray(this.square);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.bindVertexArray(null);
    gl.depthMask(true);
  }
}
