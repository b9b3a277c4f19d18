/** Parts that both pages and the worker share: WebAssembly, canvases, the chart, speeds. */

/** Load a module of `cpp/wasm`; it needs none of WASI's functions, so they do nothing. */
export async function loadModule(name) {
  const response = await fetch(new URL(name, import.meta.url), { credentials: "same-origin" });
  if (!response.ok) throw new Error(`${name} must be beside this page, got status ${response.status}`);
  const module = await WebAssembly.compile(await response.arrayBuffer());
  // The environment has no variables: its number of variables and their size are written as 0.
  const writeZeros = (...addresses) => {
    for (const address of addresses) new DataView(exports.memory.buffer).setUint32(address, 0);
    return 0;
  };
  const imports = {};
  for (const { module: namespace, name: symbol } of WebAssembly.Module.imports(module)) {
    (imports[namespace] ??= {})[symbol] = symbol === "environ_sizes_get" ? writeZeros : () => 0;
  }
  const { exports } = await WebAssembly.instantiate(module, imports);
  exports._initialize();
  return exports;
}

export const element = (id) => document.getElementById(id);

/** Multiples of real time; the last has no limit. */
export const SPEEDS = [1, 4, 16, 64, Infinity];

export const speedText = (speed) => (speed === 1 ? "real time" : speed === Infinity ? "fastest" : `${speed}x`);

export const isMotionReduced = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

/** Milliseconds between pictures: with reduced motion there are only stills. */
export const pictureInterval = () => (isMotionReduced() ? 1000 : 0);

/** Show a command that breaks into lines between options only. */
export function showCommand(code, text) {
  code.replaceChildren(...text.split(/(?= --)/).map((option) => {
    const span = document.createElement("span");
    span.textContent = option;
    return span;
  }));
}

export function showError(error) {
  element("error").textContent = `The demonstration stopped: ${error.message ?? error}`;
  element("error").hidden = false;
}

/** Clear a canvas, as fine as the screen; return its context, size and the page's colors. */
export function begin(canvas) {
  const scale = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const context = canvas.getContext("2d");
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, width, height);
  const style = getComputedStyle(document.documentElement);
  const color = (name) => style.getPropertyValue(`--${name}`);
  return { context, width, height, color };
}

export function line(context, points, color, width) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
  context.strokeStyle = color;
  context.lineWidth = width;
  context.lineCap = context.lineJoin = "round";
  context.stroke();
}

export function disc(context, x, y, radius, color) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = color;
  context.fill();
}

/**
 * Draw series of [x, y] as lines and points, the first one on top.
 *
 * `axes` has the largest x and y and the label of x.
 */
export function drawChart(canvas, series, axes) {
  const { context, width, height, color } = begin(canvas);
  const [left, right, top, bottom] = [40, width - 12, 12, height - 38];
  const toX = (x) => left + ((right - left) * x) / axes.x;
  const toY = (y) => bottom - ((bottom - top) * y) / axes.y;
  context.font = "12px system-ui, sans-serif";
  context.fillStyle = color("faint");
  context.textAlign = "right";
  for (let i = 0; i <= 5; i++) {
    const y = (axes.y * i) / 5;
    line(context, [[left, toY(y)], [right, toY(y)]], color("line"), i ? 0.5 : 1);
    context.fillText(String(y), left - 6, toY(y) + 4);
  }
  const nTicks = width < 500 ? 2 : 4;
  for (let i = 0; i <= nTicks; i++) {
    const x = (axes.x * i) / nTicks;
    context.textAlign = i < nTicks ? "center" : "right";
    context.fillText(x.toLocaleString("en"), toX(x), bottom + 15);
  }
  context.textAlign = "center";
  context.fillText(axes.label, (left + right) / 2, bottom + 31);
  const names = ["first", "second"];
  for (let i = series.length - 1; i >= 0; i--) {
    const points = series[i].map(([x, y]) => [toX(x), toY(y)]);
    context.globalAlpha = 0.55;
    line(context, points, color(names[i]), 1.5);
    context.globalAlpha = 1;
    for (const [x, y] of points) disc(context, x, y, 2.2, color(names[i]));
  }
}
