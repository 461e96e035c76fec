// What the 3D view draws: planes, lines, points, surfels and keyframes as three.js objects.
import * as THREE from 'three';

// The outline as triangles, in the plane's own axes.
function planeGeometry(plane, outline, origin) {
  const n = new THREE.Vector3(...plane.normal).normalize();
  const u = new THREE.Vector3(Math.abs(n.z) < 0.9 ? 0 : 1, 0, Math.abs(n.z) < 0.9 ? 1 : 0).cross(n).normalize();
  const v = n.clone().cross(u);
  const corners = outline.map((p) => new THREE.Vector3(...p).sub(origin));
  const flat = corners.map((p) => new THREE.Vector2(p.dot(u), p.dot(v)));
  const geometry = new THREE.BufferGeometry().setFromPoints(corners);
  geometry.setIndex(THREE.ShapeUtils.triangulateShape(flat, []).flat());
  return geometry;
}

// [key, mesh, outline] of each outline.
export function planesOf(L, origin) {
  const all = [];
  for (const plane of L.planes) {
    const key = L.label(plane), opacity = key === 'floor' ? 0.25 : 0.45;
    for (const outline of plane.outlines.filter((o) => o.length >= 3)) {
      const mesh = new THREE.Mesh(planeGeometry(plane, outline, origin), new THREE.MeshBasicMaterial({
        color: L.colours[key], transparent: true, opacity, side: THREE.DoubleSide, depthWrite: false }));
      mesh.userData = { plane, opacity };
      const edge = new THREE.BufferGeometry().setFromPoints(outline.map((p) => new THREE.Vector3(...p).sub(origin)));
      all.push([key, mesh, new THREE.LineLoop(edge, new THREE.LineBasicMaterial({ color: L.colours[key] }))]);
    }
  }
  return all;
}

// Paths lie on the floor: they are drawn over it, not through it.
const kOver = { depthTest: false, transparent: true };
const over = (thing) => { thing.renderOrder = 2; return thing; };

// [key, line] of the trajectories and the path.
export function linesOf(L, origin) {
  const all = [];
  const add = (key, list) => all.push([key, over(new THREE.Line(new THREE.BufferGeometry().setFromPoints(list.map((p) => p.sub(origin))),
    new THREE.LineBasicMaterial({ color: L.tracks[key], ...kOver })))]);
  for (const key of ['before', 'trajectory']) {
    const t = L[key];
    if (t) add(key, Array.from({ length: t.count }, (_, i) => new THREE.Vector3().fromArray(t.positions, 3 * i)));
  }
  const t = L.trajectory, floor = t && t.count ? t.positions[2] : 0;  // a path has no heights: drawn at the first pose's
  if (L.data.path) add('path', L.data.path.map((p) => new THREE.Vector3(p[0], p[1], floor + 0.02)));
  return all;
}

export function pointsOf(points, L, origin, colour, size) {
  const at = L.points(points);
  for (let i = 0; i < at.length; ++i) at[i] -= origin.getComponent(i % 3);
  const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(at, 3));
  return new THREE.Points(geometry, new THREE.PointsMaterial({ color: colour, size, sizeAttenuation: false }));
}

// Arrowheads along each keyframe's heading.
export function keyframesOf(L, origin, size) {
  const { count, poses } = L.keyframes;
  const shape = new THREE.ConeGeometry(0.6 * size, 2 * size, 4).rotateZ(-Math.PI / 2);
  const mesh = new THREE.InstancedMesh(shape, new THREE.MeshBasicMaterial({ color: L.tracks.keyframes, ...kOver }), count);
  const matrix = new THREE.Matrix4();
  for (let i = 0; i < count; ++i) {
    matrix.makeRotationZ(poses[4 * i + 3]).setPosition(new THREE.Vector3().fromArray(poses, 4 * i).sub(origin));
    mesh.setMatrixAt(i, matrix);
  }
  return over(mesh);
}

export function surfelsOf(surfels, L, origin) {
  const position = L.floats(surfels.position), radius = L.floats(surfels.radius);
  const normal = new Int8Array(L.bytes(surfels.normal).buffer);
  const mesh = new THREE.InstancedMesh(new THREE.CircleGeometry(1, 8),
    new THREE.MeshBasicMaterial({ side: THREE.DoubleSide }), surfels.count);
  const turn = new THREE.Quaternion(), up = new THREE.Vector3(0, 0, 1), n = new THREE.Vector3(), matrix = new THREE.Matrix4();
  const at = new THREE.Vector3(), scale = new THREE.Vector3();
  for (let i = 0; i < surfels.count; ++i) {
    n.fromArray(normal, 3 * i).normalize();
    turn.setFromUnitVectors(up, n.lengthSq() > 0 ? n : up);
    matrix.compose(at.fromArray(position, 3 * i).sub(origin), turn, scale.setScalar(radius[i]));
    mesh.setMatrixAt(i, matrix);
  }
  return { mesh, position };
}

// Surfels take the colour of their height, or of the grid's navigability under them.
export function surfelValues(position, kind, L) {
  const count = position.length / 3;
  if (kind === 'height') {
    // From the 2nd to the 98th percentile: one stray disc must not take all the colours.
    const sorted = Float32Array.from({ length: count }, (_, i) => position[3 * i + 2]).sort();
    const least = sorted[Math.floor(0.02 * (count - 1))], largest = sorted[Math.ceil(0.98 * (count - 1))];
    return Array.from({ length: count }, (_, i) => (position[3 * i + 2] - least) / (largest - least || 1));
  }
  const grid = L.data.grid, layer = grid.layers.navigability, codes = L.cells(layer.codes, grid.width * grid.height);
  return Array.from({ length: count }, (_, i) => {
    const column = Math.floor((position[3 * i] - grid.origin[0]) / grid.resolution);
    const row = grid.height - 1 - Math.floor((position[3 * i + 1] - grid.origin[1]) / grid.resolution);
    const inside = column >= 0 && row >= 0 && column < grid.width && row < grid.height;
    const code = inside ? codes[row * grid.width + column] : 255;
    return code === 255 ? NaN : layer.least + code / 254 * (layer.largest - layer.least);
  });
}
