// A crowd in Rapier, for others.py: read what is in it as JSON, and write the seconds that steps took, and places.

const rapier = require("@dimforge/rapier2d-compat");

const given = JSON.parse(require("node:fs").readFileSync(0, "utf-8"));

rapier.init().then(() => {
  const world = new rapier.World({ x: 0.0, y: -given.gravity });
  world.timestep = given.step;
  world.integrationParameters.contact_natural_frequency = 1.0 / given.step;
  const rubs = (shape) => shape.setRestitution(given.restitution).setFriction(given.friction);
  for (const [a, b] of given.segments)
    world.createCollider(rubs(rapier.ColliderDesc.segment({ x: a[0], y: a[1] }, { x: b[0], y: b[1] })));
  const bodies = [];
  const looks = [];
  let seconds = 0.0;
  const steps = Math.round(given.end / given.step);
  for (let n = 0; n < steps; n++) {
    while (bodies.length < given.disks.length && given.disks[bodies.length][0] <= n * given.step) {
      const [, x, y, vx, vy] = given.disks[bodies.length];
      const body = world.createRigidBody(rapier.RigidBodyDesc.dynamic().setTranslation(x, y).setLinvel(vx, vy));
      world.createCollider(rubs(rapier.ColliderDesc.ball(given.radius)).setMass(given.mass), body);
      bodies.push(body);
    }
    const begin = process.cpuUsage();
    world.step();
    const took = process.cpuUsage(begin);
    seconds += 1e-6 * (took.user + took.system);
    if (n % given.every === 0) looks.push(bodies.map((body) => [body.translation().x, body.translation().y]));
  }
  process.stdout.write(JSON.stringify({ seconds, looks }));
});
