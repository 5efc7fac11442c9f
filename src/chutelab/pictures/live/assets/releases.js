export function draw(scene) {
  const { incoming, particles } = scene;
  const releases = [], radius = [];
  scene.streams.forEach((stream, s) => {
    const r = particles[scene.kinds[s]].radius;
    for (let i = 0; i < stream.count; i += 1) {
      const [x, y] = stream.at ?? [-incoming.length, incoming.pulley_radius + r];
      const [vx, vy] = stream.velocity ?? [incoming.speed, 0];
      releases.push({ t: stream.start + i / stream.rate, x, y: y + 0.03 * Math.random() * (stream.count > 1), vx, vy, carried: !stream.at && incoming.friction === "adhesion", stream: s, kind: scene.kinds[s] });
      radius.push(r);
    }
  });
  return { releases, radius };
}
