// The 3D view with three.js: outlined planes, surfels, trajectories; click to choose a plane.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

const kHigh = 460;  // pixels

// The outline as triangles, in the plane's own axes.
function planeGeometry(plane, outline, origin) {
  const n = new THREE.Vector3(...plane.normal).normalize();
  const u = new THREE.Vector3(Math.abs(n.z) < 0.9 ? 0 : 1, 0, Math.abs(n.z) < 0.9 ? 1 : 0).cross(n).normalize();
  const v = n.clone().cross(u);
  const corners = outline.map((p) => new THREE.Vector3(...p).sub(origin));
  const flat = corners.map((p) => new THREE.Vector2(p.dot(u), p.dot(v)));
  const faces = THREE.ShapeUtils.triangulateShape(flat, []);
  const geometry = new THREE.BufferGeometry().setFromPoints(corners);
  geometry.setIndex(faces.flat());
  return geometry;
}

function surfelMesh(surfels, L, origin) {
  const position = L.floats(surfels.position), radius = L.floats(surfels.radius);
  const normal = new Int8Array(L.bytes(surfels.normal).buffer);
  const mesh = new THREE.InstancedMesh(new THREE.CircleGeometry(1, 8),
    new THREE.MeshBasicMaterial({ side: THREE.DoubleSide }), surfels.count);
  const turn = new THREE.Quaternion(), up = new THREE.Vector3(0, 0, 1), n = new THREE.Vector3(), matrix = new THREE.Matrix4();
  for (let i = 0; i < surfels.count; ++i) {
    n.fromArray(normal, 3 * i).normalize();
    turn.setFromUnitVectors(up, n.lengthSq() > 0 ? n : up);
    matrix.compose(new THREE.Vector3().fromArray(position, 3 * i).sub(origin), turn, new THREE.Vector3().setScalar(radius[i]));
    mesh.setMatrixAt(i, matrix);
  }
  return { mesh, position };
}

// Surfels take the colour of their height, or of the grid's navigability under them.
function surfelValues(position, kind, L) {
  const count = position.length / 3;
  if (kind === 'height') {
    // From the 2nd to the 98th percentile: one stray disc must not take all the colours.
    const sorted = Float32Array.from({ length: count }, (_, i) => position[3 * i + 2]).sort();
    const least = sorted[Math.floor(0.02 * (count - 1))], largest = sorted[Math.ceil(0.98 * (count - 1))];
    return Array.from({ length: count }, (_, i) => (position[3 * i + 2] - least) / (largest - least || 1));
  }
  const grid = L.data.grid, layer = grid.layers.navigability, codes = L.bytes(layer.codes);
  return Array.from({ length: count }, (_, i) => {
    const column = Math.floor((position[3 * i] - grid.origin[0]) / grid.resolution);
    const row = grid.height - 1 - Math.floor((position[3 * i + 1] - grid.origin[1]) / grid.resolution);
    const inside = column >= 0 && row >= 0 && column < grid.width && row < grid.height;
    const code = inside ? codes[row * grid.width + column] : 255;
    return code === 255 ? NaN : layer.least + code / 254 * (layer.largest - layer.least);
  });
}

window.laminaView3d = (host, L) => {
  const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  const canvas = renderer.domElement;
  canvas.tabIndex = 0;
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', '3D view of the map; arrow keys move it');
  host.append(canvas);
  const scene = new THREE.Scene();
  const box = new THREE.Box3();
  const dark = window.matchMedia('(prefers-color-scheme: dark)');
  L.planes.forEach((p) => p.outlines.forEach((o) => o.forEach((q) => box.expandByPoint(new THREE.Vector3(...q)))));
  const t = L.trajectory;
  for (let i = 0; t && i < t.count; ++i) box.expandByPoint(new THREE.Vector3().fromArray(t.positions, 3 * i));
  if (box.isEmpty()) box.set(new THREE.Vector3(-1, -1, 0), new THREE.Vector3(1, 1, 1));
  const origin = box.getCenter(new THREE.Vector3());
  const reach = Math.max(1, 0.5 * box.getSize(new THREE.Vector3()).length());

  const groups = {};
  const group = (key) => { if (!groups[key]) scene.add(groups[key] = new THREE.Group()); return groups[key]; };
  const meshes = [];
  for (const plane of L.planes) {
    const key = L.label(plane);
    for (const outline of plane.outlines.filter((o) => o.length >= 3)) {
      const geometry = planeGeometry(plane, outline, origin);
      const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({
        color: L.colours[key], transparent: true, opacity: 0.4, side: THREE.DoubleSide, depthWrite: false }));
      mesh.userData.plane = plane;
      meshes.push(mesh);
      group(key).add(mesh, new THREE.LineLoop(new THREE.BufferGeometry().setFromPoints(
        outline.map((p) => new THREE.Vector3(...p).sub(origin))), new THREE.LineBasicMaterial({ color: L.colours[key] })));
    }
  }
  for (const key of ['before', 'trajectory']) {
    if (!L[key]) continue;
    const line = Array.from({ length: L[key].count }, (_, i) => new THREE.Vector3().fromArray(L[key].positions, 3 * i).sub(origin));
    group(key).add(new THREE.Line(new THREE.BufferGeometry().setFromPoints(line), new THREE.LineBasicMaterial({ color: L.tracks[key] })));
  }
  if (L.data.path) {
    const floor = t && t.count ? t.positions[2] : 0;  // a path has no heights: drawn at the first pose's
    group('path').add(new THREE.Line(new THREE.BufferGeometry().setFromPoints(
      L.data.path.map((p) => new THREE.Vector3(p[0], p[1], floor + 0.02).sub(origin))), new THREE.LineBasicMaterial({ color: L.tracks.path })));
  }

  const camera = new THREE.PerspectiveCamera(50, 1, reach / 1000, reach * 20);
  camera.up.set(0, 0, 1);
  const controls = new OrbitControls(camera, canvas);
  controls.listenToKeyEvents(canvas);
  const render = () => renderer.render(scene, camera);
  const look = (x, y, z) => { camera.position.set(x, y, z).multiplyScalar(reach * Math.max(1, 1.7 / camera.aspect)); controls.target.set(0, 0, 0); controls.update(); render(); };

  let surfels = null;
  const colourSurfels = (kind) => {
    surfelValues(surfels.position, kind, L).forEach((v, i) => {
      const [r, g, b] = Number.isFinite(v) ? L.ramp(v) : [138, 143, 148];
      surfels.mesh.setColorAt(i, new THREE.Color().setRGB(r / 255, g / 255, b / 255, THREE.SRGBColorSpace));
    });
    surfels.mesh.instanceColor.needsUpdate = true;
    render();
  };
  const resize = () => {
    const wide = Math.max(200, host.clientWidth);
    renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    renderer.setSize(wide, kHigh, false);
    canvas.style.height = `${kHigh}px`;
    camera.aspect = wide / kHigh;
    camera.updateProjectionMatrix();
    render();
  };
  const paint = () => { scene.background = new THREE.Color(dark.matches ? 0x16191c : 0xfbfbf8); render(); };
  if (L.data.surfels && L.data.surfels.count) {
    surfels = surfelMesh(L.data.surfels, L, origin);
    group('surfels').add(surfels.mesh);
    colourSurfels('height');
  }

  let down = null;
  canvas.addEventListener('pointerdown', (e) => { down = [e.clientX, e.clientY]; });
  canvas.addEventListener('pointerup', (e) => {
    if (!down || Math.hypot(e.clientX - down[0], e.clientY - down[1]) > 4) return;
    const area = canvas.getBoundingClientRect();
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2((e.clientX - area.left) / area.width * 2 - 1, 1 - (e.clientY - area.top) / area.height * 2), camera);
    const hit = ray.intersectObjects(meshes.filter((m) => m.parent.visible), false)[0];
    if (hit) L.choose(hit.object.userData.plane.id);
  });
  controls.addEventListener('change', render);
  window.addEventListener('resize', resize);
  dark.addEventListener('change', paint);
  paint();
  resize();
  look(0.65, -1.1, 1.15);
  return {
    planeCount: new Set(meshes.map((m) => m.userData.plane.id)).size,
    setVisible: (key, on) => { if (groups[key]) { groups[key].visible = on; render(); } },
    orbit: () => look(0.65, -1.1, 1.15),
    top: () => look(0, -0.001, 1.8),
    choose: (plane) => { meshes.forEach((m) => { m.material.opacity = m.userData.plane === plane ? 0.9 : 0.4; }); render(); },
    colourSurfels,
  };
};
