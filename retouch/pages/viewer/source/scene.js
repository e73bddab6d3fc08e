// What is drawn: one or two meshes under one camera and one lamp, on a soft shadow.
import {
  DataTexture, DirectionalLight, HemisphereLight, LinearFilter, Mesh, MeshBasicMaterial, MeshStandardMaterial,
  OrthographicCamera, PlaneGeometry, Scene, Vector3, WebGLRenderer,
} from "three";

const CLAY = 0xd8d3ca;
const SHADOW_SIDE = 128;
const SHADOW_SPREAD = 1.7;
const radians = (degrees) => (degrees * Math.PI) / 180;

/** Low and high corner of the box around meshes. */
function box(meshes) {
  const low = new Vector3(Infinity, Infinity, Infinity), high = low.clone().negate();
  for (const at of everyPlace(meshes)) { low.min(at); high.max(at); }
  return { low, high };
}

function* everyPlace(meshes) {
  const at = new Vector3();
  for (const { places } of meshes) for (let k = 0; k < places.length; k += 3) yield at.fromArray(places, k);
}

function blurred(values, side, reach) {
  const result = new Float32Array(values.length);
  for (let row = 0; row < side; row += 1) {
    let sum = 0;
    for (let col = -reach; col < side; col += 1) {
      if (col + reach < side) sum += values[row * side + col + reach];
      if (col - reach - 1 >= 0) sum -= values[row * side + col - reach - 1];
      // Transposed, so that two calls blur both ways.
      if (col >= 0) result[col * side + row] = sum / (2 * reach + 1);
    }
  }
  return result;
}

/** A plane below the meshes that is darker the nearer something stands above. */
function shadow({ places }, low, high) {
  const side = SHADOW_SIDE, size = SHADOW_SPREAD * Math.max(high.x - low.x, high.y - low.y);
  const [x, y] = [(low.x + high.x) / 2, (low.y + high.y) / 2], fade = 0.25 * size;
  let dark = new Float32Array(side * side);
  for (let k = 0; k < places.length; k += 3) {
    const col = Math.floor(((places[k] - x) / size + 0.5) * side), row = Math.floor(((places[k + 1] - y) / size + 0.5) * side);
    const depth = Math.exp(-(places[k + 2] - low.z) / fade);
    if (depth > dark[row * side + col]) dark[row * side + col] = depth;
  }
  for (let pass = 0; pass < 6; pass += 1) dark = blurred(dark, side, pass < 2 ? 2 : 5);
  const texture = new DataTexture(Uint8Array.from({ length: 4 * side * side }, (_, k) => (k % 4 < 3 ? 0 : 100 * dark[k >> 2])), side, side);
  texture.magFilter = texture.minFilter = LinearFilter;
  texture.needsUpdate = true;
  const plane = new Mesh(new PlaneGeometry(size, size), new MeshBasicMaterial({ map: texture, transparent: true, depthWrite: false }));
  plane.position.set(x, y, low.z - 0.002 * size);
  return plane;
}

export class View {
  constructor(canvas, meshes) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.scene = new Scene();
    this.scene.add(new HemisphereLight(0xffffff, 0xa59d92, 1.5));
    this.lamp = new DirectionalLight(0xfffaf2, 2.4);
    this.camera = new OrthographicCamera();
    this.camera.up.set(0, 0, 1);
    this.scene.add(this.lamp, this.lamp.target, this.camera);
    this.plain = new MeshStandardMaterial({ color: CLAY, roughness: 0.62 });
    this.painted = new MeshStandardMaterial({ vertexColors: true, roughness: 0.8 });
    this.solids = meshes.map((mesh) => {
      const solid = new Mesh(mesh.geometry, this.plain);
      this.scene.add(solid);
      return solid;
    });
    this.meshes = meshes;
    const { low, high } = box(meshes);
    this.scene.add(shadow(meshes.at(-1), low, high));
    this.middle = low.clone().add(high).multiplyScalar(0.5);
    this.radius = low.distanceTo(high) / 2;
    this.reset();
  }

  /** The first view: from the front, to the left and above; the lamp at the upper left. */
  reset() {
    Object.assign(this, { azimuth: -62, elevation: 32, zoom: 1, lampAzimuth: -48, lampElevation: 38 });
    this.target = this.middle.clone();
    this.aim();
    const right = new Vector3().setFromMatrixColumn(this.camera.matrix, 0), up = new Vector3().setFromMatrixColumn(this.camera.matrix, 1);
    let [across, high, low] = [0, -Infinity, Infinity];
    for (const at of everyPlace(this.meshes)) {
      at.sub(this.middle);
      across = Math.max(across, Math.abs(at.dot(right)));
      high = Math.max(high, at.dot(up));
      low = Math.min(low, at.dot(up));
    }
    // The object's middle as it is seen lies in the middle of the picture.
    this.target.addScaledVector(up, (high + low) / 2);
    this.fit = { across: 1.12 * across, up: 0.65 * (high - low) };
  }

  /** Points the camera and the lamp, which stays where it is seen: the object turns under it. */
  aim() {
    const [a, e] = [radians(this.azimuth), radians(this.elevation)];
    const away = new Vector3(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e));
    this.camera.position.copy(this.target).addScaledVector(away, 4 * this.radius);
    // From straight above the usual up is along the line of sight.
    this.camera.up.set(-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e));
    this.camera.lookAt(this.target);
    this.camera.updateMatrix();
    const [la, le] = [radians(this.lampAzimuth), radians(this.lampElevation)];
    this.lamp.position.set(Math.sin(la) * Math.cos(le), Math.cos(la) * Math.cos(le), Math.sin(le)).transformDirection(this.camera.matrix).multiplyScalar(this.radius).add(this.target);
    this.lamp.target.position.copy(this.target);
  }

  turn(right, up) {
    this.azimuth -= right;
    this.elevation = Math.min(90, Math.max(-90, this.elevation + up));
  }

  /** The lamp by its direction in the picture and its height above the picture's plane, degrees. */
  light(right, up) {
    const e = radians(this.lampElevation), a = radians(this.lampAzimuth);
    const x = Math.cos(e) * Math.sin(a) + radians(right), y = Math.cos(e) * Math.cos(a) + radians(up), far = Math.min(0.998, Math.hypot(x, y));
    this.lampAzimuth = (Math.atan2(x, y) * 180) / Math.PI;
    this.lampElevation = (Math.acos(far) * 180) / Math.PI;
  }

  move(right, up) {
    const axis = (column) => new Vector3().setFromMatrixColumn(this.camera.matrix, column);
    this.target.addScaledVector(axis(0), -right / this.pixelsPerMm).addScaledVector(axis(1), up / this.pixelsPerMm);
  }

  paint(layer) {
    this.solids.forEach((solid, k) => {
      const colours = this.meshes[k].layers.get(layer);
      if (colours) solid.geometry.setAttribute("color", colours);
      solid.material = colours ? this.painted : this.plain;
    });
  }

  /** Draws the first mesh left of a part of the width, the last one right of it. */
  draw(width, height, split) {
    this.aim();
    this.renderer.setSize(width, height, false);
    const half = Math.max(this.fit.up, (this.fit.across * height) / width) / this.zoom;
    this.pixelsPerMm = height / (2 * half);
    Object.assign(this.camera, { top: half, bottom: -half, right: (half * width) / height, left: (-half * width) / height, near: 0, far: 9 * this.radius });
    this.camera.updateProjectionMatrix();
    const edge = this.solids.length > 1 ? Math.round(split * width) : width;
    const parts = this.solids.length > 1 ? [[0, edge], [edge, width - edge]] : [[0, width]];
    this.renderer.setScissorTest(parts.length > 1);
    parts.forEach(([left, wide], k) => {
      if (wide <= 0) return;
      this.renderer.setScissor(left, 0, wide, height);
      this.solids.forEach((solid, number) => { solid.visible = number === k; });
      this.renderer.render(this.scene, this.camera);
    });
  }
}
