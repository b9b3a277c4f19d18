/** The page of experiment B: settings, two acrobots, the curves of their test episodes. */
import { SPEEDS, begin, disc, drawChart, element, isMotionReduced, line, pictureInterval, showCommand, showError, speedText } from "./page.js";

const N_EPISODES = 1000;
const MOST_STEPS = 50;
const INTERVAL = 10; // learning episodes between test episodes
const NAMES = ["SDNN-C", "Fuzzy Q-learning"];

const worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
let isRunning = !isMotionReduced();
let generation = 0; // counts restarts: reports of earlier ones are ignored
let begun = null; // the settings of the present trials
let sides = null; // the last report
let tests = [[], []];
let isFinished = false;
let isDirty = false;
let lastPicture = -Infinity;

function settings() {
  return {
    sensors: Number(element("sensors").value),
    noise: Number(element("noise").value),
    seed: Number(element("seed").value),
    preset: element("preset").value,
  };
}

/** Return the command that runs the same trials; `sdnn-c` alone has the paper's settings. */
function command({ sensors, noise, seed, preset }) {
  const agent = preset === "paper" ? "sdnn-c" : `sdnn-c-${preset}`;
  return `sdnn reproduce b --sensors ${sensors} --noise ${noise} --agent ${agent} --agent fuzzy`
    + ` --trials 1 --episodes ${N_EPISODES} --seed ${seed}`;
}

function showSettings() {
  const { sensors, noise } = settings();
  element("noise-text").value = noise.toFixed(3);
  element("sensors-text").value = sensors;
  element("speed-text").value = speedText(SPEEDS[element("speed").value]);
  element("speed").setAttribute("aria-valuetext", element("speed-text").value);
}

function showRunning() {
  element("run").textContent = isRunning ? "Pause" : "Start";
  element("run").disabled = false;
}

function restart() {
  showSettings();
  if (!element("settings").reportValidity()) return;
  tests = [[], []];
  isFinished = false;
  generation++;
  begun = settings();
  element("result").hidden = true;
  element("copy").textContent = "Copy the command";
  showRunning();
  const speed = SPEEDS[element("speed").value];
  worker.postMessage({ generation, settings: begun, speed, isRunning });
}

worker.onmessage = ({ data }) => {
  if (data.error) {
    showError(data.error);
    return;
  }
  if (data.generation !== generation) return;
  ({ sides } = data);
  sides.forEach((side, i) => tests[i].push(...side.tests));
  isDirty = true;
  element("restart").disabled = false;
  if (data.digest && !isFinished) finish(data.digest);
};
worker.onerror = showError;

function finish(digest) {
  isFinished = true;
  lastPicture = -Infinity; // also without motion, the last picture is shown
  element("digest").textContent = digest.slice(0, 16);
  showCommand(element("command"), command(begun));
  element("result").hidden = false;
  showRunning();
}

/** Draw the acrobot: the angle of the second link is relative to the first, 0 hangs down. */
function drawAcrobot(canvas, side, name) {
  const { context, width, height, color } = begin(canvas);
  const scale = Math.min(width, height) / 4.6;
  const [x0, y0] = [width / 2, height / 2 + 0.1 * scale];
  const x1 = x0 + scale * Math.sin(side.angle1);
  const y1 = y0 + scale * Math.cos(side.angle1);
  const x2 = x1 + scale * Math.sin(side.angle1 + side.angle2);
  const y2 = y1 + scale * Math.cos(side.angle1 + side.angle2);
  context.setLineDash([6, 6]);
  line(context, [[0.06 * width, y0 - 1.5 * scale], [0.94 * width, y0 - 1.5 * scale]], color("faint"), 1.5);
  context.setLineDash([]);
  line(context, [[x0, y0], [x1, y1], [x2, y2]], color(name), 0.12 * scale);
  disc(context, x0, y0, 0.09 * scale, color("text"));
  disc(context, x1, y1, 0.13 * scale, color("text"));
  disc(context, x2, y2, 0.09 * scale, color(name));
  const turn = (side.torque / 10) * 0.75 * Math.PI; // an arc around the motor shows the torque
  context.beginPath();
  context.arc(x1, y1, 0.28 * scale, -Math.PI / 2, -Math.PI / 2 - turn, turn > 0);
  context.strokeStyle = color("text");
  context.lineWidth = 2;
  context.stroke();
}

function summaryOf(name, steps) {
  const reached = steps.filter((value) => value > 0).length;
  return `${name} reached the goal in ${reached} of ${steps.length} tests`;
}

function draw(now) {
  requestAnimationFrame(draw);
  if (!isDirty || now - lastPicture < pictureInterval()) return;
  isDirty = false;
  lastPicture = now;
  sides.forEach((side, i) => {
    drawAcrobot(element(`picture-${i}`), side, ["first", "second"][i]);
    const episode = isFinished ? "its last test" : `episode ${side.episode}`;
    element(`progress-${i}`).textContent = `${episode}, ${side.decision} s`;
  });
  const series = tests.map((steps) =>
    steps.map((value, test) => [INTERVAL * (test + 1), value > 0 ? value : MOST_STEPS]));
  drawChart(element("chart"), series, { x: N_EPISODES, y: MOST_STEPS, label: "learning episodes" });
  element("summary").textContent = `${NAMES.map((name, i) => summaryOf(name, tests[i])).join("; ")}.`;
}

element("run").onclick = () => {
  isRunning = !isRunning;
  showRunning();
  worker.postMessage({ isRunning });
};
element("restart").onclick = restart;
element("speed").oninput = () => {
  showSettings();
  worker.postMessage({ speed: SPEEDS[element("speed").value] });
};
element("settings").onsubmit = (event) => event.preventDefault();
for (const id of ["noise", "sensors"]) element(id).oninput = showSettings;
for (const id of ["noise", "sensors", "preset", "seed"]) element(id).onchange = restart;
element("copy").hidden = !navigator.clipboard; // pages without TLS have none
element("copy").onclick = async () => {
  await navigator.clipboard.writeText(element("command").textContent);
  element("copy").textContent = "Copied";
};
for (const query of ["(prefers-color-scheme: dark)", "(prefers-reduced-motion: reduce)"]) {
  matchMedia(query).onchange = () => { isDirty = sides !== null; };
}
addEventListener("resize", () => { isDirty = sides !== null; });
restart();
requestAnimationFrame(draw);
