"use strict";
// The particles of a run as instances of one shape, drawn by WebGL: `show(frame)`, `colour(field, ..)`.

const {
  BufferGeometry, BufferAttribute, Color, DataTexture, DoubleSide, InstancedBufferAttribute, InstancedBufferGeometry, LineBasicMaterial,
  LineSegments, LinearFilter, Mesh, OrbitControls, OrthographicCamera, PerspectiveCamera, Quaternion, RGBAFormat, Scene, ShaderMaterial, Vector3, WebGLRenderer,
} = library;

const MISSING = -3e38;  // the value of a particle that has none
const BAR = 0.05;       // height of a bar in 1D over its length

// Corners of a unit shape in VTK's order, as in _particles.py, and its faces.
const FACES = { 2: [[0, 1, 2, 3]], 3: [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]] };
const SQUARE = [[-1, -1], [1, -1], [1, 1], [-1, 1]];

const FRAGMENT = `
  uniform sampler2D map;
  uniform float low, high, outlines, kinds;
  uniform vec3 noValue, line;
  varying vec2 face;
  varying float shown;
  varying vec3 eye;

  vec3 mapped() {
    if (shown < -1e38) return noValue;
    if (kinds > 0.0) return texture2D(map, vec2((mod(floor(shown + 0.5), kinds) + 0.5)/kinds, 0.5)).rgb;
    float at = clamp((shown - low)/(high - low), 0.0, 1.0);
    return texture2D(map, vec2((at*255.0 + 0.5)/256.0, 0.5)).rgb;
  }
  void main() {
    vec3 colour = mapped();
#ifdef POINTS
    float r2 = dot(face, face);
    if (r2 > 1.0) discard;
  #ifdef SPACE
    colour *= 0.45 + 0.55*sqrt(1.0 - r2);
  #endif
#else
  #ifdef SPACE
    colour *= 0.5 + 0.5*abs(normalize(cross(dFdx(eye), dFdy(eye))).z);
  #endif
    vec2 side = abs(face), width = fwidth(face);
    vec2 near = smoothstep(vec2(1.0) - 1.6*width, vec2(1.0) - 0.6*width, side);
    float room = 1.0 - smoothstep(0.15, 0.5, max(width.x, width.y));  // none on particles of few pixels
    colour = mix(colour, line, outlines*room*max(near.x, near.y));
#endif
    gl_FragColor = vec4(colour, 1.0);
  }`;

// Obstacles: grey, round ones in sectors of two shades.
const SOLID_VERTEX = `
  attribute float shade;
  varying float tone;
  varying vec3 eye;
  void main() {
    vec4 at = modelViewMatrix*vec4(position, 1.0);
    tone = 0.62 - 0.08*shade;
    eye = at.xyz;
    gl_Position = projectionMatrix*at;
  }`;
const SOLID_FRAGMENT = `
  varying float tone;
  varying vec3 eye;
  void main() {
    float light = 1.0;
#ifdef SPACE
    light = 0.5 + 0.5*abs(normalize(cross(dFdx(eye), dFdy(eye))).z);
#endif
    gl_FragColor = vec4(vec3(tone*light), 1.0);
  }`;

/** The vertex shader for a kind of shape: where a corner of it is, in the scene. */
function vertexShader(kind, corners) {
  const inputs = {
    points: "",
    axes: "attribute vec3 offset0, offset1, offset2;",
    corners: Array.from({ length: corners }, (_, c) => `attribute vec3 offset${c};`).join("\n"),
  }[kind];
  const offset = {
    points: "vec3(0.0)",
    axes: "position.x*(offset0 - middle) + position.y*(offset1 - middle) + position.z*(offset2 - middle)",
    corners: `offsets[int(corner)] - middle`,
  }[kind];
  const list = kind === "corners" ? `vec3 offsets[${corners}] = vec3[${corners}](${Array.from({ length: corners }, (_, c) => `offset${c}`).join(", ")});` : "";
  return `
  attribute vec3 place;
  attribute vec2 uv2;
  attribute float corner, value;
  ${inputs}
  uniform vec3 origin, stride;
  uniform float side, middle, radius;  // side: of an offset of one, a little more, so that rounding leaves no gaps
  varying vec2 face;
  varying float shown;
  varying vec3 eye;
  void main() {
    face = uv2;
    shown = value;
    ${list}
    vec4 at = modelViewMatrix*vec4(origin + stride*(place - 1.0) + side*(${offset}), 1.0);
    ${kind === "points" ? "at.xy += radius*uv2;" : ""}
    eye = at.xyz;
    gl_Position = min(place.x, min(place.y, place.z)) < 0.5 ? vec4(2.0, 2.0, 2.0, 1.0) : projectionMatrix*at;  // 0: nowhere
  }`;
}

/** What a view of everything shows: the grid, or the particles where they fill little of it and are alone. */
function bounds(about) {
  const corners = (low, high) => [low, high].map((x) => new Vector3(...x.map((v, d) => (d < about.dim ? v : 0))));
  let [low, high] = corners(about.box[0], about.box[1]);
  const size = (a, b) => b.clone().sub(a).length();
  const [first, last] = corners(about.low, about.high);
  if (about.obstacles.length === 0 && size(first, last) < 0.4 * size(low, high)) {
    const room = new Vector3(1, 1, 1).multiplyScalar(0.5 * about.size);
    [low, high] = [first.sub(room), last.add(room)];
  }
  if (about.dim < 3) low.z = high.z = 0;
  if (about.dim === 1) [low.y, high.y] = [-BAR * (high.x - low.x), BAR * (high.x - low.x)];
  return [low, high];
}

class Viewer {
  constructor(box, about, look) {
    this.about = about;
    this.box = box;
    this.dim = about.dim;
    this.frame = 0;
    this.look = look;
    [this.low, this.high] = bounds(about);
    this.centre = this.low.clone().add(this.high).multiplyScalar(0.5);
    this.scale = 2 / Math.max(this.high.clone().sub(this.low).length(), 1e-300);  // metres to the scene

    this.renderer = new WebGLRenderer({ antialias: true, alpha: true, powerPreference: "high-performance" });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.canvas = this.renderer.domElement;
    box.append(this.canvas);
    this.labels = ["x", "y", "z"].slice(0, this.dim).map((axis) => element("span", { class: "axis" }, axis));
    box.append(...this.labels);
    this.scene = new Scene();
    this.camera = this.dim === 3 ? new PerspectiveCamera(35, 1, 0.01, 100) : new OrthographicCamera(-1, 1, 1, -1, -100, 100);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.zoomToCursor = true;
    if (this.dim < 3) {
      this.controls.enableRotate = false;
      this.controls.screenSpacePanning = true;
      this.controls.mouseButtons.LEFT = 2;  // pan
      this.controls.touches.ONE = 1;
    }
    this.controls.addEventListener("change", () => this.invalidate());
    this.outline = new LineSegments(this.boxLines(), new LineBasicMaterial({ color: look.line }));
    this.scene.add(this.outline);
    this.obstacles = about.obstacles.map((obstacle) => this.addObstacle(obstacle));
    this.places = [];
    this.offsets = [];
    new ResizeObserver(() => this.resize()).observe(box);
    this.resize();
    this.home();
  }

  /** Unpacks places and domains. */
  async load() {
    const { dim, about } = this;
    for (let d = 0; d < dim; ++d) this.places.push(await unpacked(`place ${"xyz"[d]}`));
    const rows = { points: 0, axes: dim, corners: 2 ** dim }[about.kind];
    for (let c = 0; c < rows; ++c) {
      this.offsets.push([]);
      for (let d = 0; d < dim; ++d) this.offsets[c].push(await unpacked(`offset ${c} ${"xyz"[d]}`));
    }
    this.makeShape();
  }

  addObstacle({ triangles, shades, places, turns }) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(triangles.map((v) => v * this.scale)), 3));
    geometry.setAttribute("shade", new BufferAttribute(new Float32Array(shades.flatMap((shade) => [shade, shade, shade])), 1));
    const mesh = new Mesh(geometry, new ShaderMaterial({ vertexShader: SOLID_VERTEX, fragmentShader: SOLID_FRAGMENT, side: DoubleSide,
      defines: this.dim === 3 ? { SPACE: "" } : {} }));
    mesh.frustumCulled = false;
    this.scene.add(mesh);
    return { mesh, places, turns };
  }

  makeShape() {
    const { about } = this, { kind } = about;
    const geometry = new InstancedBufferGeometry();
    const flat = this.dim < 3 || kind === "points";
    const signs = flat ? SQUARE.map((s) => [...s, 0]) : about.corners;
    const faces = flat ? FACES[2] : FACES[3];
    const position = [], uv = [], corner = [], index = [];
    for (const f of faces) {
      const first = corner.length;
      f.forEach((c, k) => { position.push(...signs[c]); uv.push(...SQUARE[k]); corner.push(c); });
      index.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(position), 3));
    geometry.setAttribute("uv2", new BufferAttribute(new Float32Array(uv), 2));
    geometry.setAttribute("corner", new BufferAttribute(new Float32Array(corner), 1));
    geometry.setIndex(index);
    geometry.instanceCount = about.count;
    const of = (type, width) => new InstancedBufferAttribute(new type(width * about.count), width);
    geometry.setAttribute("place", of(Uint16Array, 3));
    geometry.setAttribute("value", of(Float32Array, 1));
    const rows = { points: 0, axes: 3, corners: flat ? 4 : 8 }[kind];
    for (let c = 0; c < rows; ++c) {
      const attribute = of(Uint16Array, 3);
      attribute.array.fill(about.middle);
      geometry.setAttribute(`offset${c}`, attribute);
    }
    if (this.dim === 1 && kind === "axes") {  // the height of a bar
      const height = Math.min(about.middle - 1, (BAR / 2) * (this.high.x - this.low.x) / about.side);
      for (let k = 0; k < about.count; ++k) geometry.attributes.offset1.array[3 * k + 1] = about.middle + height;
    }
    const origin = ["x", "y", "z"].map((a, d) => (d < this.dim ? (about.low[d] - this.centre[a]) * this.scale : 0));
    this.material = new ShaderMaterial({
      vertexShader: vertexShader(kind, rows), fragmentShader: FRAGMENT, side: DoubleSide,
      defines: { ...(kind === "points" ? { POINTS: "" } : {}), ...(this.dim === 3 ? { SPACE: "" } : {}) },
      uniforms: {
        origin: { value: new Vector3(...origin) }, stride: { value: new Vector3(...about.step.map((v) => v * this.scale)) }, side: { value: about.side * about.grow * this.scale },
        middle: { value: about.middle }, radius: { value: about.size * this.scale / 2 }, map: { value: null }, low: { value: 0 }, high: { value: 1 },
        outlines: { value: 0.35 }, kinds: { value: 0 }, noValue: { value: new Vector3(...NO_VALUE.map((v) => v / 255)) }, line: { value: new Vector3(0, 0, 0) },
      },
    });
    const mesh = new Mesh(geometry, this.material);
    mesh.frustumCulled = false;
    this.geometry = geometry;
    this.scene.add(mesh);
  }

  /** Colours by values of all frames, and a range of them; map: a name of MAPS, or null for whole numbers. */
  colour(values, low, high, map) {
    this.values = values;
    const uniforms = this.material.uniforms;
    uniforms.low.value = low;
    uniforms.high.value = high > low ? high : low + (Math.abs(low) || 1);
    uniforms.kinds.value = map === null ? KINDS.length : 0;
    const count = map === null ? KINDS.length : 256;
    const texture = new DataTexture(map === null ? kindBytes(count) : colourBytes(map, count), count, 1, RGBAFormat);
    if (map !== null) texture.minFilter = texture.magFilter = LinearFilter;
    texture.needsUpdate = true;
    uniforms.map.value?.dispose();
    uniforms.map.value = texture;
    this.show(this.frame);
  }

  /** Draws this frame. */
  show(frame) {
    const { count } = this.about;
    this.frame = frame;
    const from = frame * count;
    const copy = (name, planes) => {
      const attribute = this.geometry.attributes[name];
      planes.forEach((plane, d) => { for (let k = 0; k < count; ++k) attribute.array[3 * k + d] = plane[from + k]; });
      attribute.needsUpdate = true;
    };
    if (this.dim < 3) this.geometry.attributes.place.array.fill(1);
    copy("place", this.places);
    this.offsets.forEach((planes, c) => copy(`offset${c}`, planes));
    for (const { mesh, places, turns } of this.obstacles) {
      mesh.position.set(...places.slice(3 * frame, 3 * frame + 3)).sub(this.centre).multiplyScalar(this.scale);
      if (this.dim < 3) mesh.position.z = -0.5;  // behind the particles
      mesh.quaternion.copy(new Quaternion(...turns.slice(4 * frame, 4 * frame + 4)));
    }
    if (this.values) {
      this.geometry.attributes.value.array.set(this.values.subarray(from, from + count));
      this.geometry.attributes.value.needsUpdate = true;
    }
    this.invalidate();
  }

  set radius(factor) {
    this.material.uniforms.radius.value = factor * this.about.size * this.scale / 2;
    this.invalidate();
  }

  set outlines(are) {
    this.material.uniforms.outlines.value = are ? 0.35 : 0;
    this.invalidate();
  }

  set boxShown(is) {
    this.outline.visible = is;
    this.invalidate();
  }

  set obstaclesShown(are) {
    this.obstacles.forEach(({ mesh }) => { mesh.visible = are; });
    this.invalidate();
  }

  setLook(look) {
    this.look = look;
    this.outline.material.color = new Color(look.line);
    this.invalidate();
  }

  /** Draws before the next repaint, once. */
  invalidate() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.draw(); });
  }

  draw() {
    this.renderer.render(this.scene, this.camera);
    this.placeLabels();
    this.ondraw?.();
  }

  /** Where a place in metres is, in pixels of the box. */
  pixel(x) {
    const at = x.clone().sub(this.centre).multiplyScalar(this.scale).project(this.camera);
    return [(at.x + 1) / 2 * this.box.clientWidth, (1 - at.y) / 2 * this.box.clientHeight, at.z];
  }

  placeLabels() {
    this.labels.forEach((label, d) => {
      const axis = "xyz"[d];
      const end = this.low.clone();
      end[axis] = this.high[axis];
      const [x, y] = this.pixel(end);
      label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
      label.textContent = `${axis} ${readable(this.high[axis], digitsOf(this.low[axis], this.high[axis]))} m`;
      label.hidden = !this.outline.visible;
    });
  }

  boxLines() {
    const at = (k) => ["x", "y", "z"].map((a, d) => ((k >> d) & 1 ? this.high[a] : this.low[a]) - this.centre[a]).map((v) => v * this.scale);
    const ends = [];
    const flat = this.dim < 3;
    for (let k = 0; k < (flat ? 4 : 8); ++k) for (let d = 0; d < (flat ? 2 : 3); ++d) if (!((k >> d) & 1)) ends.push(...at(k), ...at(k | (1 << d)));
    return new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(ends), 3));
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.box;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    if (this.dim === 3) this.camera.aspect = width / height;
    else this.fitPlane();
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  /** Half the width and height that an unzoomed orthographic camera shows: all, with a margin. */
  fitPlane() {
    const half = this.high.clone().sub(this.low).multiplyScalar(0.5 * 1.12 * this.scale);
    const aspect = this.box.clientWidth / this.box.clientHeight;
    const up = Math.max(half.y, half.x / aspect, 1e-9);
    Object.assign(this.camera, { left: -up * aspect, right: up * aspect, top: up, bottom: -up });
  }

  /** Back to a view of everything. */
  home() {
    this.controls.target.set(0, 0, 0);
    if (this.dim === 3) {
      const up = new Vector3(...this.look.up);
      const side = Math.abs(up.x) > 0.5 ? new Vector3(0, 1, 0) : new Vector3(1, 0, 0);
      const front = new Vector3().crossVectors(side, up);
      this.camera.up.copy(up);
      this.camera.position.copy(side.multiplyScalar(0.5)).addScaledVector(front, 0.9).addScaledVector(up, 0.45).setLength(3.4);
    } else {
      this.camera.position.set(0, 0, 10);
      this.camera.zoom = 1;
    }
    this.camera.lookAt(0, 0, 0);
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.invalidate();
  }

  /** Place of particle k in this frame, m. */
  at(k) {
    const code = this.places.map((plane) => plane[this.frame * this.about.count + k]);
    if (code.includes(0)) return null;
    return new Vector3(...["x", "y", "z"].map((_, d) => (d < this.dim ? this.about.low[d] + this.about.step[d] * (code[d] - 1) : 0)));
  }

  /** The particle drawn nearest to a pixel, if there is one near; in front of others. */
  pick(px, py) {
    let best = null, least = Infinity;
    for (let k = 0; k < this.about.count; ++k) {
      const x = this.at(k);
      if (!x) continue;
      const [u, v, depth] = this.pixel(x);
      const apart = (u - px) ** 2 + (v - py) ** 2;
      if (apart > 400) continue;
      const badness = apart + (this.dim === 3 ? 1e5 * depth : 0);
      if (badness < least) [best, least] = [k, badness];
    }
    return best;
  }

  /** Pixels of a metre in the middle. */
  pixelsPerMetre() {
    const [x0] = this.pixel(this.centre), right = new Vector3(1, 0, 0).applyQuaternion(this.camera.quaternion).multiplyScalar(1 / this.scale);
    const [x1] = this.pixel(this.centre.clone().add(right));
    return Math.abs(x1 - x0) * this.scale;
  }
}
