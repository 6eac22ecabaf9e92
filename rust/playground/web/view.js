// The picture: links, pegs, forces, goal and trail in three.js, and what lies under the pointer.

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import { BODY, FORCE, FORCE_SCALE, GOAL, HEAD, LONGEST_ARROW, MARK, MARK_WIDTH, PEG, PEG_HEIGHT, SPRING, SPRING_WIDTH, TINT, TRAIL } from "./palette.js";

const FORCE_SHOWN = 0.1; // [N]
const PEGS = 256; // of which springs are drawn
const ON_GROUND = 0.0004; // between what lies on the ground [m]
const TRAIL_LENGTH = 600;
const FAR_BELOW = -1000;
const SIZE = 24; // of the ground that is drawn [m]

// One square metre of the ground: a line every 10 cm, and a stronger one around. A texture rather than lines, which some
// drivers cut wrongly where they pass behind the camera.
function gridTile(major, minor) {
  const canvas = document.createElement("canvas"), size = canvas.width = canvas.height = 1024;
  const pen = canvas.getContext("2d");
  for (const [colour, width, cells] of [[minor, 3, 10], [major, 5, 1]]) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    for (let k = 0; k <= cells; k++) {
      const at = size * k / cells;
      pen.beginPath();
      pen.moveTo(at, 0);
      pen.lineTo(at, size);
      pen.moveTo(0, at);
      pen.lineTo(size, at);
      pen.stroke();
    }
  }
  const texture = new THREE.CanvasTexture(canvas);
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  texture.colorSpace = THREE.SRGBColorSpace;
  return texture;
}

export class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true, preserveDrawingBuffer: true});
    this.renderer.shadowMap.enabled = true;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(40, 1, 0.05, 60);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 0.49 * Math.PI;
    this.controls.enableDamping = true;
    this.raycaster = new THREE.Raycaster();
    this.light();
    this.ground();
    this.goal = new THREE.Group();
    this.patches = new THREE.Group();
    this.scene.add(this.goal, this.patches);
    // A spring is a bar from the place where it holds a peg to where the peg is, on its top face.
    this.anchors = this.instances(new THREE.CylinderGeometry(SPRING_WIDTH, SPRING_WIDTH, 0.004, 24).rotateX(Math.PI / 2), SPRING, PEGS);
    this.bars = this.instances(new THREE.BoxGeometry(0.01, 0.01, 1).translate(0, 0, 0.5), SPRING, PEGS);
    const positions = new THREE.BufferAttribute(new Float32Array(3 * TRAIL_LENGTH), 3);
    this.trail = new THREE.Line(new THREE.BufferGeometry().setAttribute("position", positions), new THREE.LineBasicMaterial({color: TRAIL}));
    this.trail.frustumCulled = false;
    this.scene.add(this.trail);
    this.shafts = this.instances(new THREE.CylinderGeometry(0.006, 0.006, 1, 8).translate(0, 0.5, 0).rotateX(Math.PI / 2), FORCE, 256);
    this.tips = this.instances(new THREE.ConeGeometry(0.016, 0.035, 12).translate(0, -0.0175, 0).rotateX(Math.PI / 2), FORCE, 256);
    this.band = new THREE.Line(new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(new Float32Array(6), 3)), new THREE.LineBasicMaterial({color: SPRING}));
    this.band.frustumCulled = false;
    this.scene.add(this.band);
    this.centre = new THREE.Vector3();
  }

  light() {
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f86, 1.6));
    this.sun = new THREE.DirectionalLight(0xffffff, 1.8);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    Object.assign(this.sun.shadow.camera, {left: -2.5, right: 2.5, top: 2.5, bottom: -2.5, near: 0.5, far: 12});
    this.sun.shadow.bias = -0.0005;
    this.scene.add(this.sun, this.sun.target);
  }

  ground() {
    const dark = window.matchMedia("(prefers-color-scheme: dark)").matches;
    const background = new THREE.Color(dark ? 0x1b2023 : 0xf4f5f2);
    this.scene.background = background;
    this.scene.fog = new THREE.Fog(background, 5, 12);
    this.floor = new THREE.Mesh(new THREE.PlaneGeometry(SIZE, SIZE), new THREE.ShadowMaterial({opacity: dark ? 0.45 : 0.22, depthWrite: false}));
    this.floor.receiveShadow = true;
    const [major, minor] = dark ? ["#4a555b", "#30383c"] : ["#c3c9c2", "#e4e8e2"];
    const tile = gridTile(major, minor);
    tile.anisotropy = this.renderer.capabilities.getMaxAnisotropy();
    tile.repeat.set(SIZE, SIZE);
    this.grid = new THREE.Mesh(new THREE.PlaneGeometry(SIZE, SIZE), new THREE.MeshBasicMaterial({map: tile, transparent: true, depthWrite: false}));
    this.scene.add(this.grid, this.floor);
  }

  instances(geometry, colour, count) {
    const mesh = new THREE.InstancedMesh(geometry, new THREE.MeshStandardMaterial({color: colour, roughness: 0.55}), count);
    mesh.castShadow = true;
    mesh.receiveShadow = true;
    mesh.frustumCulled = false;
    mesh.count = 0;
    this.scene.add(mesh);
    return mesh;
  }

  remove(mesh) {
    if (!mesh) return;
    this.scene.remove(mesh);
    mesh.geometry.dispose();
    mesh.dispose();
  }

  // `shapes`: half length and radius of each link. Its back is against x in the plane, along y in 3D.
  setRobot(shapes, spatial) {
    this.remove(this.links);
    this.remove(this.marks);
    const [half, radius] = shapes[0];
    const wide = MARK_WIDTH * radius, thin = 0.1 * radius, up = 0.97 * radius;
    const stripe = new THREE.BoxGeometry(spatial ? wide : thin, spatial ? thin : wide, 1.4 * half);
    this.marks = this.instances(spatial ? stripe.translate(0, up, 0) : stripe.translate(-up, 0, 0), MARK, shapes.length);
    this.marks.count = shapes.length;
    const capsule = new THREE.CapsuleGeometry(radius, 2 * half, 8, 20).rotateX(Math.PI / 2);
    this.links = this.instances(capsule, 0xffffff, shapes.length);
    this.links.count = shapes.length;
    const colour = new THREE.Color();
    shapes.forEach((_, k) => this.links.setColorAt(k, colour.setHex(k === 0 ? HEAD : BODY).multiplyScalar(k % 2 ? 0.86 : 1)));
    this.links.instanceColor.needsUpdate = true;
  }

  // Radius, x and y of each peg; of those on springs number, x and y of the place where the spring holds it; of those that
  // are boxes number, sides and angle; of those that are balls number and height.
  setPegs(pegs, springs, boxes, balls) {
    const count = pegs.length / 3, room = Math.max(64, 2 ** Math.ceil(Math.log2(count + 1)));
    if (!this.discs || this.discs.instanceMatrix.count < count) {
      this.remove(this.discs);
      this.remove(this.boxes);
      this.remove(this.balls);
      this.discs = this.instances(new THREE.CylinderGeometry(1, 1, 1, 40).rotateX(Math.PI / 2), PEG, room);
      this.boxes = this.instances(new THREE.BoxGeometry(1, 1, 1), PEG, room);
      this.balls = this.instances(new THREE.SphereGeometry(1, 32, 16), PEG, room);
    }
    const matrix = new THREE.Matrix4(), edges = new Map(), heights = new Map();
    for (let k = 0; k < boxes.length; k += 4) edges.set(boxes[k], boxes.slice(k + 1, k + 4));
    for (let k = 0; k < balls.length; k += 2) heights.set(balls[k], balls[k + 1]);
    for (const mesh of [this.discs, this.boxes, this.balls]) mesh.numbers = [];
    for (let k = 0; k < count; k++) {
      const [radius, x, y] = pegs.slice(3 * k, 3 * k + 3), [length, width, angle] = edges.get(k) ?? [radius, radius, 0];
      const mesh = heights.has(k) ? this.balls : edges.has(k) ? this.boxes : this.discs, tall = heights.has(k) ? radius : PEG_HEIGHT;
      matrix.makeRotationZ(angle).scale(new THREE.Vector3(length, width, tall)).setPosition(x, y, heights.get(k) ?? PEG_HEIGHT / 2);
      mesh.setMatrixAt(mesh.numbers.push(k) - 1, matrix);
    }
    for (const mesh of [this.discs, this.boxes, this.balls]) {
      mesh.count = mesh.numbers.length;
      mesh.instanceMatrix.needsUpdate = true;
      mesh.computeBoundingSphere();
    }
    const turn = new THREE.Quaternion(), z = new THREE.Vector3(0, 0, 1), top = PEG_HEIGHT + 0.004;
    this.anchors.count = this.bars.count = Math.min(PEGS, springs.length / 3);
    for (let k = 0; k < this.anchors.count; k++) {
      const [peg, x, y] = springs.slice(3 * k, 3 * k + 3), home = new THREE.Vector3(x, y, top);
      const along = new THREE.Vector3(pegs[3 * peg + 1], pegs[3 * peg + 2], top).sub(home), length = along.length();
      turn.setFromUnitVectors(z, along.normalize());
      this.anchors.setMatrixAt(k, matrix.makeTranslation(x, y, top));
      this.bars.setMatrixAt(k, matrix.compose(home, turn, new THREE.Vector3(1, 1, Math.max(1e-6, length))));
    }
    this.anchors.instanceMatrix.needsUpdate = this.bars.instanceMatrix.needsUpdate = true;
  }

  // Convex polygons of the ground with their factors of friction, later ones over earlier ones.
  setPatches(patches) {
    for (const mesh of this.patches.children) mesh.geometry.dispose();
    this.patches.clear();
    patches.forEach(({vertices, factor}, k) => {
      const shape = new THREE.Shape(vertices.map(([x, y]) => new THREE.Vector2(x, y)));
      const mesh = new THREE.Mesh(new THREE.ShapeGeometry(shape), new THREE.MeshBasicMaterial({color: TINT[factor], depthWrite: false}));
      mesh.position.z = ON_GROUND * (1 + k / patches.length);
      mesh.renderOrder = -1;
      this.patches.add(mesh);
    });
  }

  // x, y and radius; radius 0 is a line across x, not a number is no goal.
  setGoal([x, y, radius]) {
    this.goal.clear();
    if (!Number.isFinite(x)) return;
    const material = new THREE.MeshBasicMaterial({color: GOAL, side: THREE.DoubleSide});
    const shape = radius > 0 ? new THREE.RingGeometry(radius - 0.012, radius, 64) : new THREE.PlaneGeometry(0.02, 2);
    const mesh = new THREE.Mesh(shape, material);
    mesh.position.set(x, y, 0.003);
    this.goal.add(mesh);
  }

  // Looks at a robot that begins there.
  look(centre, spatial) {
    this.resize();
    this.centre.set(centre[0], centre[1], 0);
    this.spatial = spatial;
    this.trailCount = 0;
    this.aim();
  }

  // Places the camera: the robot on the left, the goal on the right; in an upright picture the robot below, the goal above.
  aim() {
    const {x, y} = this.centre, [back, up] = this.spatial ? [2.5, 1.5] : [2.3, 2.6];
    this.controls.target.set(x + (this.spatial ? 0 : 0.45), y, 0);
    if (this.camera.aspect < 1) this.camera.position.set(x - back, y, up + 0.8);
    else this.camera.position.set(x + (this.spatial ? 0.5 : 0.1), y - back, up);
  }

  // Moves the view with the robot.
  follow(centre) {
    const moved = new THREE.Vector3(centre[0] - this.centre.x, centre[1] - this.centre.y, 0);
    this.centre.add(moved);
    this.camera.position.add(moved);
    this.controls.target.add(moved);
  }

  extendTrail(centre) {
    const positions = this.trail.geometry.attributes.position;
    if (this.trailCount === TRAIL_LENGTH) {
      positions.array.copyWithin(0, 3);
      this.trailCount--;
    }
    positions.setXYZ(this.trailCount++, centre[0], centre[1], 0.004);
    positions.needsUpdate = true;
    this.trail.geometry.setDrawRange(0, this.trailCount);
  }

  // Poses of the links, seven numbers each; forces on them, three each.
  showRobot(poses, forces) {
    const matrix = new THREE.Matrix4(), place = new THREE.Vector3(), turn = new THREE.Quaternion(), one = new THREE.Vector3(1, 1, 1);
    for (let k = 0; k < this.links.count; k++) {
      place.fromArray(poses, 7 * k);
      turn.fromArray(poses, 7 * k + 3);
      this.links.setMatrixAt(k, matrix.compose(place, turn, one));
      this.marks.setMatrixAt(k, matrix);
    }
    this.links.instanceMatrix.needsUpdate = this.marks.instanceMatrix.needsUpdate = true;
    this.links.computeBoundingSphere();
    this.showForces(poses, forces);
  }

  // An arrow ends above the link on which the force acts.
  showForces(poses, forces) {
    const force = new THREE.Vector3(), end = new THREE.Vector3(), turn = new THREE.Quaternion(), matrix = new THREE.Matrix4();
    const z = new THREE.Vector3(0, 0, 1);
    let count = 0;
    for (let k = 0; k < this.links.count && count < 256; k++) {
      force.fromArray(forces, 3 * k);
      const length = Math.min(LONGEST_ARROW, FORCE_SCALE * force.length());
      if (force.length() < FORCE_SHOWN) continue;
      end.fromArray(poses, 7 * k).add(new THREE.Vector3(0, 0, 0.06));
      turn.setFromUnitVectors(z, force.normalize());
      const start = end.clone().addScaledVector(force, -length);
      this.shafts.setMatrixAt(count, matrix.compose(start, turn, new THREE.Vector3(1, 1, Math.max(1e-6, length - 0.03))));
      this.tips.setMatrixAt(count++, matrix.compose(end, turn, new THREE.Vector3(1, 1, 1)));
    }
    for (const mesh of [this.shafts, this.tips]) {
      mesh.count = count;
      mesh.instanceMatrix.needsUpdate = true;
    }
  }

  // A line from the link that is pulled to the pointer; null: none.
  showPull(from, to) {
    const positions = this.band.geometry.attributes.position;
    positions.setXYZ(0, ...(from ?? [0, 0, FAR_BELOW]));
    positions.setXYZ(1, ...(to ?? [0, 0, FAR_BELOW]));
    positions.needsUpdate = true;
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
    if (width === this.width && height === this.height || width === 0 || height === 0) return;
    [this.width, this.height] = [width, height];
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    const turned = this.camera.aspect < 1 !== width < height;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (turned) this.aim();
  }

  draw() {
    this.resize();
    this.controls.update();
    const {x, y} = this.centre;
    this.sun.position.set(x - 2, y - 2.5, 5);
    this.sun.target.position.set(x, y, 0);
    this.floor.position.set(x, y, 2.5 * ON_GROUND);
    this.grid.position.set(Math.round(x), Math.round(y), 3 * ON_GROUND);
    this.renderer.render(this.scene, this.camera);
  }

  ray(event) {
    const box = this.canvas.getBoundingClientRect();
    const x = 2 * (event.clientX - box.left) / box.width - 1, y = 1 - 2 * (event.clientY - box.top) / box.height;
    this.camera.updateMatrixWorld();
    this.raycaster.setFromCamera(new THREE.Vector2(x, y), this.camera);
    return this.raycaster;
  }

  // What lies under the pointer: {kind: "peg" or "link", index, point}, or null.
  pick(event) {
    const ray = this.ray(event);
    const [hit] = ray.intersectObjects([this.links, this.discs, this.boxes, this.balls].filter(Boolean), false);
    if (!hit) return null;
    const {object, instanceId, point} = hit;
    return object === this.links ? {kind: "link", index: instanceId, point} : {kind: "peg", index: object.numbers[instanceId], point};
  }

  // The point under the pointer in the horizontal plane through `point`, or with `facing` in that across the view.
  onPlane(event, point, facing = false) {
    const normal = facing ? this.camera.getWorldDirection(new THREE.Vector3()) : new THREE.Vector3(0, 0, 1);
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(normal, point);
    return this.ray(event).ray.intersectPlane(plane, new THREE.Vector3());
  }

  // Pixel of a point of the ground, for tests.
  pixel(x, y, z = 0) {
    this.camera.updateMatrixWorld();
    const point = new THREE.Vector3(x, y, z).project(this.camera), box = this.canvas.getBoundingClientRect();
    return [box.left + (point.x + 1) / 2 * box.width, box.top + (1 - point.y) / 2 * box.height];
  }
}

export const groundPoint = (x, y) => new THREE.Vector3(x, y, 0);

// Poses between two control instants.
export function between(before, after, share) {
  if (before.length !== after.length) return after;
  const poses = new Float64Array(after.length);
  for (let k = 0; k < after.length; k += 7) {
    let dot = 0;
    for (let j = 3; j < 7; j++) dot += before[k + j] * after[k + j];
    for (let j = 0; j < 3; j++) poses[k + j] = before[k + j] + share * (after[k + j] - before[k + j]);
    let norm = 0;
    for (let j = 3; j < 7; j++) {
      poses[k + j] = (1 - share) * Math.sign(dot) * before[k + j] + share * after[k + j];
      norm += poses[k + j] ** 2;
    }
    for (let j = 3; j < 7; j++) poses[k + j] /= Math.sqrt(norm);
  }
  return poses;
}
