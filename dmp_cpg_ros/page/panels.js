// Copyright 2026 The dmp_cpg_ros authors
// SPDX-License-Identifier: Apache-2.0
// What is drawn on flat canvases: oscillators, times of a stop, footfalls, speeds, the stick.

export const COLOURS = { fl: '#ef5b5b', fr: '#4d9bff', rl: '#f2a93b', rr: '#3cc48a' };
const TEXT = '#e8edf3', DIM = '#97a3b3', LINE = '#2c3542', GO = '#37b36b', HALT = '#e5484d';
const SECONDS = 8;  // that the graph of speeds shows
const FONT = 'system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';

/** Clear a canvas and return its context, in CSS pixels, with its size. */
function begin(canvas) {
  const dense = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * dense) || canvas.height !== Math.round(height * dense)) {
    canvas.width = Math.round(width * dense);
    canvas.height = Math.round(height * dense);
  }
  const ink = canvas.getContext('2d');
  ink.setTransform(dense, 0, 0, dense, 0, 0);
  ink.clearRect(0, 0, width, height);
  ink.font = `12px ${FONT}`;
  ink.textBaseline = 'middle';
  return [ink, width, height];
}

function disc(ink, x, y, radius, fill, stroke) {
  ink.beginPath();
  ink.arc(x, y, Math.max(0, radius), 0, 2 * Math.PI);
  if (fill) { ink.fillStyle = fill; ink.fill(); }
  if (stroke) { ink.strokeStyle = stroke; ink.stroke(); }
}

/** A number as text; none is -0.00. */
function rounded(value, count = 2) {
  return (Math.abs(value) < 0.5 * 10 ** -count ? 0 : value).toFixed(count);
}

function write(ink, text, x, y, colour = DIM, align = 'left') {
  ink.fillStyle = colour;
  ink.textAlign = align;
  ink.fillText(text, x, y);
}

/** States between two states: frames are coarse, and the way is about the origin. */
function arc(from, to, parts = 5) {
  const [r, s] = [Math.hypot(...from), Math.hypot(...to)], begin = Math.atan2(from[1], from[0]);
  const turn = Math.atan2(from[0] * to[1] - from[1] * to[0], from[0] * to[0] + from[1] * to[1]);
  return Array.from({ length: parts + 1 }, (_, i) => {
    const share = i / parts, radius = r + (s - r) * share, angle = begin + turn * share;
    return [radius * Math.cos(angle), radius * Math.sin(angle)];
  });
}

/** The four states on their circles, placed as the legs are, seen from above. */
export class Oscillators {
  constructor(canvas) {
    this.canvas = canvas;
    this.trails = [[], [], [], []];
  }

  /** Remember a frame's states. */
  take(frame) {
    (frame.x || []).forEach((x, i) => {
      this.trails[i].push(x);
      if (this.trails[i].length > 22) this.trails[i].shift();
    });
  }

  draw(frame, scene) {
    const [ink, width, height] = begin(this.canvas);
    if (!frame.x || !frame.places) return;
    const side = Math.min(width / 2, height / 2);
    scene.legs.forEach((leg, i) => {
      const x0 = width / 2 + (i % 2 ? 0.5 : -0.5) * width / 2, y0 = (i < 2 ? 0.25 : 0.75) * height;
      const unit = side * 0.36, colour = COLOURS[leg];
      const at = ([x1, x2]) => [x0 + unit * x1, y0 - unit * x2];
      ink.lineWidth = 1;
      ink.strokeStyle = LINE;
      ink.beginPath();
      ink.moveTo(x0 - unit * 1.2, y0); ink.lineTo(x0 + unit * 1.2, y0);
      ink.moveTo(x0, y0 - unit * 1.2); ink.lineTo(x0, y0 + unit * 1.2);
      ink.stroke();
      ink.font = `10px ${FONT}`;
      write(ink, 'x₁', x0 + unit * 1.2 + 3, y0);
      write(ink, 'x₂', x0 + 4, y0 - unit * 1.2 + 3);
      ink.lineWidth = 1.5;
      const radius = Math.hypot(...frame.places[i]);
      disc(ink, x0, y0, unit * radius, null, '#465265');
      const [px, py] = at(frame.places[i]), armed = frame.gains && frame.gains[i] > 0;
      if (armed || scene.inhibited.includes(leg)) {
        const inside = Math.hypot(frame.x[i][0] - frame.places[i][0], frame.x[i][1] - frame.places[i][1])
          <= frame.region;
        ink.setLineDash(armed ? [] : [4, 3]);
        disc(ink, px, py, unit * (frame.region || 0),
          armed ? (inside ? 'rgb(229 72 77 / 45%)' : 'rgb(229 72 77 / 22%)') : 'rgb(151 163 179 / 14%)',
          armed ? HALT : DIM);
        ink.setLineDash([]);
      }
      ink.strokeStyle = DIM;
      ink.beginPath();
      ink.moveTo(px - 4, py); ink.lineTo(px + 4, py);
      ink.moveTo(px, py - 4); ink.lineTo(px, py + 4);
      ink.stroke();
      ink.lineWidth = 2.5;
      ink.strokeStyle = colour;
      for (let k = 1; k < this.trails[i].length; k++) {
        ink.globalAlpha = 0.75 * k / this.trails[i].length;
        ink.beginPath();
        for (const x of arc(this.trails[i][k - 1], this.trails[i][k])) ink.lineTo(...at(x));
        ink.stroke();
      }
      ink.globalAlpha = 1;
      const [sx, sy] = at(frame.x[i]);
      ink.lineWidth = 1;
      ink.strokeStyle = '#5b687a';
      ink.beginPath(); ink.moveTo(x0, y0); ink.lineTo(sx, sy); ink.stroke();
      disc(ink, sx, sy, 6.5, colour, '#fff');
      const left = x0 - (i % 2 ? -1 : 1) * (width / 4 - 4);
      ink.font = `600 13px ${FONT}`;
      write(ink, leg, left, y0 - side / 2 + 14, colour, i % 2 ? 'right' : 'left');
    });
  }
}

/** Predicted, bounded and measured time of the last stop or start, live while it lasts; in words for
 * who cannot see it. */
export function drawTimes(canvas, frame) {
  const [ink, width] = begin(canvas);
  const stop = frame.stop || {}, number = (name) => parseFloat(stop[name]);
  const predicted = number('predicted_s'), bound = number('bound_s'), begun = number('request_stamp');
  const busy = !['at_rest', 'walking', 'free'].includes(stop.state);
  let taken = number('measured_s');
  if (busy && Number.isFinite(begun)) taken = Math.max(0, frame.time - begun);
  if (!Number.isFinite(taken) && !Number.isFinite(predicted)) {
    write(ink, 'no stop requested yet', 0, 12);
    return;
  }
  const label = 68, value = 62, end = width - value, ends = [predicted, bound, taken].filter(Number.isFinite);
  const scale = (end - label) / (1.08 * Math.max(0.2, ...ends));
  const row = (y, name, seconds, colour, text) => {
    write(ink, name, 0, y);
    ink.fillStyle = '#242c37';
    ink.fillRect(label, y - 7, end - label, 14);
    if (Number.isFinite(seconds)) {
      ink.fillStyle = colour;
      ink.fillRect(label, y - 7, Math.max(1, seconds * scale), 14);
    }
    write(ink, text || (Number.isFinite(seconds) ? `${seconds.toFixed(3)} s` : '–'), width, y, TEXT, 'right');
  };
  const now = busy ? 'elapsed' : 'measured', what = frame.requested ? 'to rest' : 'to walking';
  row(11, 'predicted', predicted, '#5aa9f5');
  row(33, now, taken, taken > bound ? HALT : busy ? '#f0a32f' : GO);
  if (Number.isFinite(bound)) {
    const x = label + bound * scale;
    ink.strokeStyle = TEXT;
    ink.lineWidth = 1.5;
    ink.beginPath(); ink.moveTo(x, 0); ink.lineTo(x, 46); ink.stroke();
    write(ink, `bound ${bound.toFixed(3)} s`, Math.min(x, width - 44), 57, TEXT, 'center');
  }
  write(ink, what, 0, 57);
  canvas.setAttribute('aria-label', [['predicted', predicted], [now, taken], ['bound', bound]]
    .filter(([, seconds]) => Number.isFinite(seconds))
    .map(([name, seconds]) => `${name} ${seconds.toFixed(3)} s`).join(', ') + ` ${what}`);
}

/** Which feet bear load, over the last seconds. */
export class Footfalls {
  constructor(canvas) {
    this.canvas = canvas;
    this.past = [];
  }

  take(frame) {
    if (!frame.load) return;
    if (this.past.length && frame.time < this.past[this.past.length - 1].time) this.past = [];
    this.past.push({ time: frame.time, load: frame.load });
    while (this.past.length && this.past[0].time < frame.time - 4) this.past.shift();
  }

  draw(scene) {
    const [ink, width, height] = begin(this.canvas);
    if (!this.past.length) return;
    const end = this.past[this.past.length - 1].time, left = 26, row = height / 4;
    const x = (time) => left + (width - left) * (1 - (end - time) / 4);
    scene.legs.forEach((leg, i) => {
      const y = row * (i + 0.5);
      ink.fillStyle = 'rgb(17 21 27 / 65%)';
      ink.fillRect(0, y - row * 0.44, width, row * 0.88);
      ink.font = `600 12px ${FONT}`;
      write(ink, leg, 5, y, COLOURS[leg]);
      ink.fillStyle = COLOURS[leg];
      for (let k = 1; k < this.past.length; k++) {
        if (this.past[k].load[i] > 1) {
          const from = x(this.past[k - 1].time);
          ink.fillRect(from, y - row * 0.36, x(this.past[k].time) - from + 0.6, row * 0.72);
        }
      }
    });
  }
}

/** Reference and measured forward speed, over the last seconds. */
export class Speeds {
  constructor(canvas) {
    this.canvas = canvas;
    this.past = [];
  }

  take(frame) {
    if (this.past.length && frame.time < this.past[this.past.length - 1].time) this.past = [];
    this.past.push({ time: frame.time, speed: frame.speed[0], reference: (frame.reference || [0])[0] });
    while (this.past.length && this.past[0].time < frame.time - SECONDS) this.past.shift();
  }

  draw(frame) {
    const [ink, width, height] = begin(this.canvas);
    if (this.past.length < 2) return;
    const end = this.past[this.past.length - 1].time, top = 18;
    const all = this.past.flatMap((past) => [past.speed, past.reference]);
    const low = Math.min(-0.1, ...all), high = Math.max(0.3, ...all);
    const x = (time) => width * (1 - (end - time) / SECONDS);
    const y = (speed) => height - 2 - (height - top - 4) * (speed - low) / (high - low);
    ink.strokeStyle = LINE;
    ink.beginPath(); ink.moveTo(0, y(0)); ink.lineTo(width, y(0)); ink.stroke();
    for (const [name, colour, line] of [['speed', TEXT, 1.2], ['reference', '#5aa9f5', 2]]) {
      ink.strokeStyle = colour;
      ink.lineWidth = line;
      ink.beginPath();
      this.past.forEach((past) => ink.lineTo(x(past.time), y(past[name])));
      ink.stroke();
    }
    ink.font = `10px ${FONT}`;
    write(ink, `${high.toFixed(1)} m/s`, 0, y(high) + 6);
    write(ink, '0', 0, y(0) - 6);
    write(ink, `${SECONDS} s`, width, y(0) - 6, DIM, 'right');
    ink.font = `12px ${FONT}`;
    write(ink, `reference ${rounded((frame.reference || [0])[0])} m/s`, 0, 8, '#5aa9f5');
    write(ink, `body ${rounded(frame.speed[0])} m/s, ${rounded(frame.speed[2])} rad/s`, width, 8, TEXT, 'right');
  }
}

/** The stick: where it is held is (turn, forward) in the unit disc. */
export function drawStick(canvas, [turn, forward], active) {
  const [ink, width, height] = begin(canvas);
  const x0 = width / 2, y0 = height / 2, reach = width / 2 - 20;
  ink.lineWidth = 1.5;
  disc(ink, x0, y0, width / 2 - 1, '#12171e', LINE);
  disc(ink, x0, y0, reach, null, LINE);
  ink.beginPath();
  ink.moveTo(x0 - reach, y0); ink.lineTo(x0 + reach, y0);
  ink.moveTo(x0, y0 - reach); ink.lineTo(x0, y0 + reach);
  ink.stroke();
  const x = x0 - reach * turn, y = y0 - reach * forward;
  ink.lineWidth = 4;
  ink.strokeStyle = '#5aa9f5';
  ink.beginPath(); ink.moveTo(x0, y0); ink.lineTo(x, y); ink.stroke();
  ink.lineWidth = 2;
  disc(ink, x, y, 18, active ? '#5aa9f5' : '#38465a', '#7f8ea3');
}
