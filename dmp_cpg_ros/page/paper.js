// Copyright 2026 The dmp_cpg_ros authors
// SPDX-License-Identifier: Apache-2.0
// The page of the paper: Python in the browser computes, this shows. paper_page.py puts panels.js
// before it and everything into one file.

const SETTLED_MS = 150;            // time without another input after which is computed
const PLACE = 'https://page.invalid/';   // where Pyodide believes that the parts of the page are
const SLOWED = 2;                  // the film runs this much slower than the robot
const STATES = { waiting: '#f0a32f', captured: '#e5484d', at_rest: '#7a2a33', releasing: '#2f6fb0' };

const find = (name) => document.getElementById(name);
const inputs = ['inhibition_gain', 'region_radius', 'cadence_scale', 'coupling_gain', 'coupling_graph',
  'leg', 'gait'].map(find);
const circles = new Oscillators(find('oscillators'));
let computer = null, episode = null, at = 0, playing = true, waiting = 0;

// --- Python ----------------------------------------------------------------------------------------

/** A part of the page as a Response: base64 of gzip. */
async function part(name, type) {
  const bytes = Uint8Array.from(atob(find(name).textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  const content = await new Response(stream).arrayBuffer();
  return new Response(content, { headers: { 'Content-Type': type } });
}

async function run(name) {
  const script = document.createElement('script');
  script.src = URL.createObjectURL(await (await part(name, 'text/javascript')).blob());
  await new Promise((loaded, failed) => {
    script.onload = loaded;
    script.onerror = failed;
    document.head.append(script);
  });
}

async function start() {
  window.fetch = (address) => {
    const name = String(address.url || address).split('/').pop();
    return part(name, name.endsWith('.wasm') ? 'application/wasm' : 'application/octet-stream');
  };
  await run('pyodide.asm.js');
  await run('pyodide.js');
  const python = await window.loadPyodide({ indexURL: PLACE });
  await python.loadPackage(PLACE + document.querySelector('[id^=numpy-]').id);
  python.unpackArchive(await (await part('core.zip', 'application/zip')).arrayBuffer(), 'zip',
    { extractDir: '/core' });
  python.globals.set('given', await (await part('given.json', 'application/json')).text());
  computer = python.runPython(`
import json, sys
sys.path.append('/core')
from dmp_cpg_ros.paper.interactive import Page
Page(**json.loads(given))`);
  const gaits = JSON.parse(python.globals.get('given')).gaits;
  find('gait').append(...Object.keys(gaits).map((name) => new Option(name)));
}

// --- what is computed ------------------------------------------------------------------------------

function values() {
  return Object.fromEntries(inputs.map((input) => [
    input.id, input.type === 'range' ? Number(input.value) : input.value]));
}

function changed() {
  for (const input of inputs) if (input.type === 'range') input.parentElement.querySelector('output').textContent = input.value;
  find('busy').textContent = 'computing …';
  clearTimeout(waiting);
  waiting = setTimeout(compute, SETTLED_MS);
}

/** What Python computes of values; in the browser's console too. */
function answer(what, asked) {
  return JSON.parse(computer.answer(what, JSON.stringify(asked)));
}
window.answer = answer;

function compute() {
  const asked = values();
  try {
    showCertificate(answer('certificate', asked));
    episode = answer('episode', asked);
  } catch (error) {
    find('verdict').textContent = String(error.message).trim().split('\n').pop();
    find('verdict').className = 'fails';
    find('broken').replaceChildren();
    episode = null;
  }
  at = 0;
  circles.trails = [[], [], [], []];
  if (episode) showTimes();
  find('busy').textContent = '';
  document.body.dataset.shown = JSON.stringify(asked);
}

const digits = (value) => (value === null ? '∞' : String(Number(value.toPrecision(4))));

function element(tag, className, text) {
  const made = document.createElement(tag);
  made.className = className;
  made.textContent = text || '';
  return made;
}

function bar(side, value, name, unit, most) {
  const made = element('div', `bar ${side}`), fill = element('i', '');
  fill.style.width = `${value === null ? 100 : Math.max(0, 100 * value / most)}%`;
  made.append(fill, element('span', '', `${digits(value)}${unit ? ` ${unit}` : ''}  ${name}`));
  return made;
}

function showCertificate(found) {
  find('verdict').textContent = found.holds ? 'holds' : `fails: ${found.failing.join(', ')}`;
  find('verdict').className = found.holds ? 'holds' : 'fails';
  find('broken').replaceChildren(...found.broken.map((line) => element('li', '', line)));
  find('omega').textContent = `ω ${found.omega.map((omega) => omega.toFixed(1)).join(' to ')} rad/s`;
  find('inequalities').replaceChildren(...Object.values(found.inequalities).map((row) => {
    const made = element('div', `side ${row.holds ? '' : row.required ? 'fails' : 'missed'}`);
    const most = Math.max(1e-12, row.left ?? Infinity, row.right ?? Infinity);   // null: infinite
    made.dataset.name = row.name;
    made.title = row.sentence;
    const named = element('b', '', row.name);
    named.append(element('br', ''), element('small', '', row.holds ? `margin ${digits(row.margin)}`
      : row.required ? 'fails' : 'does not hold (not required)'));
    made.append(named, bar('left', row.left, row.left_is, row.unit, most),
      bar('right', row.right, row.right_is, row.unit, most));
    return made;
  }));
}

function showTimes() {
  const told = (name, { predicted, measured }) => `${name}: predicted ${predicted === null
    ? `not in ${episode.patience} s` : `${predicted.toFixed(3)} s`}, taken ${measured === null ? '–' : `${measured.toFixed(3)} s`}`;
  find('spans').textContent = `${told('to rest', episode.stop)}; ${told('to walking', episode.start)}`;
}

// --- what is drawn ---------------------------------------------------------------------------------

function drawStates(now) {
  const [ink, width, height] = begin(find('states')), { frames, legs } = episode;
  const end = frames[frames.length - 1].time, left = 24, low = height - 16, row = low / 4;
  const x = (time) => left + (width - left) * time / end;
  ink.globalAlpha = 0.4;
  for (let k = 0, next; k < frames.length - 1; k = next) {
    for (next = k + 1; next < frames.length - 1 && frames[next].state === frames[k].state;) next++;
    ink.fillStyle = STATES[frames[k].state] || 'transparent';
    ink.fillRect(x(frames[k].time), 0, x(frames[next].time) - x(frames[k].time), low);
  }
  ink.globalAlpha = 1;
  legs.forEach((leg, i) => {
    const middle = row * (i + 0.5);
    write(ink, leg, 0, middle, COLOURS[leg]);
    ink.strokeStyle = COLOURS[leg];
    ink.lineWidth = 1.6;
    ink.beginPath();
    for (const frame of frames) ink.lineTo(x(frame.time), middle - 0.42 * row * frame.x[i][0]);
    ink.stroke();
  });
  ink.setLineDash([4, 3]);
  ink.lineWidth = 1;
  for (const [name, { time, predicted }] of [['inhibit', episode.stop], ['release', episode.start]]) {
    write(ink, name, x(time) + 3, height - 7, TEXT);
    ink.strokeStyle = TEXT;
    ink.strokeRect(x(time), 0, predicted === null ? 0 : x(time + predicted) - x(time), low);
  }
  ink.setLineDash([]);
  ink.strokeStyle = '#fff';
  ink.beginPath(); ink.moveTo(x(now), 0); ink.lineTo(x(now), low); ink.stroke();
}

let last = 0;
function film(milliseconds) {
  const passed = Math.min(0.1, (milliseconds - last) * 1e-3);
  last = milliseconds;
  if (episode) {
    const { frames } = episode, end = frames[frames.length - 1].time;
    if (playing) at = (at + passed / SLOWED) % end;
    const k = frames.findIndex((frame) => frame.time >= at), frame = frames[k];
    circles.trails = frame.x.map((_, i) => frames.slice(Math.max(0, k - 21), k + 1).map((past) => past.x[i]));
    circles.draw({ ...frame, region: episode.region }, { legs: episode.legs, inhibited: [] });
    drawStates(at);
    find('time').value = 1000 * at / end;
    find('clock').textContent = `${frame.time.toFixed(2)} s, ${frame.state.replace('_', ' ')}, ${frame.speed.toFixed(2)} m/s`;
  }
  requestAnimationFrame(film);
}

find('time').addEventListener('input', () => {
  playing = false;
  find('play').textContent = 'play';
  if (episode) at = find('time').value / 1000 * episode.frames[episode.frames.length - 1].time;
});
find('play').addEventListener('click', () => {
  playing = !playing;
  find('play').textContent = playing ? 'pause' : 'play';
});

start().then(() => {
  for (const input of inputs) input.addEventListener('input', changed);
  changed();
  requestAnimationFrame(film);
}, (error) => { find('busy').textContent = `Python does not start: ${error.message}`; });
