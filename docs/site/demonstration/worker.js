/** The two trials of experiment B, apart from the page, which stays smooth. */
import { SPEEDS, loadModule } from "./page.js";

const N_EPISODES = 1000;
const STEPS_PER_DECISION = 50; // of integration
const BUSY_MILLISECONDS = 25; // of calculation between two reports
const SIDES = [0, 1];

const loading = loadModule("acrobot.wasm");
let core = null;
let generation = 0; // counts restarts, which the page numbers
let speed = SPEEDS[0];
let isRunning = false;
let timer = null;
let clock = 0; // simulated seconds
let lastTick = 0;
let nReported = [0, 0]; // test episodes
let digest = null; // of all rows, once there are all
let nDecided = 0; // by each agent, since the clock began

/** Return the identity of the case with these sensors, as `sdnn reproduce` names it. */
function caseOf(sensors, noise) {
  if (noise === 0) return `s${sensors}`;
  return noise === 0.02 ? `s${sensors}-noise` : `s${sensors}-noise-${noise}`;
}

function restart({ sensors, noise, seed, preset }) {
  const text = new TextEncoder().encode(caseOf(sensors, noise));
  new Uint8Array(core.memory.buffer).set(text, core.text());
  core.begin(text.length, sensors, noise, seed, preset === "robust" ? 1 : 0, N_EPISODES);
  nReported = [0, 0];
  digest = null;
  startClock();
}

function startClock() {
  clock = nDecided = 0;
  lastTick = performance.now();
}

const isFinished = () => SIDES.every((side) => core.is_finished(side));

/** Let both agents make the decisions that are due. */
function keepTime(now) {
  clock += (Math.min(now - lastTick, 250) / 1000) * speed;
  for (; nDecided <= clock && performance.now() < now + BUSY_MILLISECONDS; nDecided++) {
    for (const side of SIDES) if (!core.is_finished(side)) core.decide(side);
  }
  clock = Math.min(clock, nDecided);
}

/** Let the agents learn for some milliseconds, side by side in episodes. */
function hurry(now) {
  while (!isFinished() && performance.now() < now + BUSY_MILLISECONDS) {
    const side = core.is_finished(0) || (!core.is_finished(1) && core.episode(1) < core.episode(0)) ? 1 : 0;
    core.finish_episode(side);
  }
}

/** Return the decision to show and the share of its second that has passed. */
function shownMoment(side) {
  const last = core.n_decisions(side) - 1;
  if (isFinished()) {
    const time = clock % (last + 2); // the last state stays for a second
    return [Math.min(last, Math.floor(time)), time > last ? 1 : time % 1];
  }
  return [last, speed === Infinity || core.is_finished(side) ? 1 : Math.min(1, clock + 1 - nDecided)];
}

function stateOf(side) {
  const tests = [];
  for (; nReported[side] < core.n_tests(side); nReported[side]++) tests.push(core.test_steps(side, nReported[side]));
  const episode = core.episode(side);
  if (core.n_decisions(side) === 0) return { angle1: 0, angle2: 0, torque: 0, episode, decision: 0, tests };
  const [decision, share] = shownMoment(side);
  const address = core.state(side, decision, Math.round(share * STEPS_PER_DECISION));
  const [angle1, angle2] = new Float64Array(core.memory.buffer, address, 2);
  return { angle1, angle2, torque: core.torque(side, decision), episode, decision: decision + 1, tests };
}

function report() {
  postMessage({ generation, sides: SIDES.map(stateOf), digest });
}

/** Let the agents learn; once they have finished, repeat their last test episodes. */
function tick() {
  const now = performance.now();
  if (digest !== null) clock += ((now - lastTick) / 1000) * Math.min(speed, SPEEDS[1]);
  else if (speed === Infinity) hurry(now);
  else keepTime(now);
  if (digest === null && isFinished()) {
    core.digest();
    digest = new TextDecoder().decode(new Uint8Array(core.memory.buffer, core.text(), 64));
    startClock();
  }
  lastTick = now;
  report();
  timer = isRunning ? setTimeout(tick, speed === Infinity && digest === null ? 0 : 16) : null;
}

onmessage = async ({ data }) => {
  try {
    core ??= await loading;
    if (data.settings) {
      generation = data.generation;
      restart(data.settings);
      report();
    }
    if (data.speed !== undefined && data.speed !== speed) {
      speed = data.speed;
      startClock();
    }
    isRunning = data.isRunning ?? isRunning;
    lastTick = performance.now();
    if (isRunning && timer === null) tick();
  } catch (error) {
    postMessage({ error: String(error) });
  }
};
