// Copyright 2026 The dmp_cpg_ros authors
// SPDX-License-Identifier: Apache-2.0
// The page: reads frames from the server, shows them, and sends commands.

import { hear_keys } from '/keys.js';
import { Footfalls, Oscillators, Speeds, drawStick, drawTimes } from '/panels.js';
import { View } from '/scene.js';

const SEND_MS = 80;               // time between two commands while the robot is driven or pushed
const SILENT_MS = 1500;           // silence of the suite after which the page says so
const ANSWER_MS = 12000;          // how long an answer of the suite is shown
const WEIGHTS_PER_HEIGHT = 0.6;   // force of a drag as long as the robot is high, in its weight
const GRAVITY = 9.81;

const token = new URLSearchParams(window.location.search).get('token') || '';
const find = (name) => document.getElementById(name);

let scene = null, frame = null, heard = 0, fresh = false;
let stick = [0, 0], steering = false, moving = false;
let gamepad = [0, 0, 0], held = [];  // ahead, to the left, around to the left; buttons that are held
const keys = new Set();

const oscillators = new Oscillators(find('oscillators')), footfalls = new Footfalls(find('footfalls'));
const speeds = new Speeds(find('speeds'));
let view = null, trouble = '';
try {
  view = new View(find('scene'));
} catch (error) {
  trouble = error.message;
}

// --- the server ------------------------------------------------------------------------------------

const ask = (path, options = {}) => fetch(path, { ...options, headers: { Authorization: `Bearer ${token}` } });
const pause = (ms) => new Promise((done) => { setTimeout(done, ms); });

/** Send a command; returns what the suite says, and null when it cannot be asked. */
async function send(command) {
  try {
    const answer = await ask('/command', { method: 'POST', body: JSON.stringify(command) });
    return answer.ok ? await answer.json() : { taken: false, text: await answer.text() };
  } catch {
    return null;
  }
}

/** Send a command and show the answer. */
async function request(command) {
  const answer = await send(command) || { taken: false, text: 'no connection' };
  const line = document.createElement('li');
  line.textContent = `${answer.taken ? '' : 'refused: '}${answer.text}`;
  line.className = answer.taken ? '' : 'refused';
  find('answers').append(line);
  while (find('answers').children.length > 3) find('answers').firstChild.remove();
  await pause(ANSWER_MS);
  line.remove();
}

/** Read frames, a line of JSON each, for as long as they come. */
async function read() {
  const answer = await ask('/frames');
  if (!answer.ok) throw new Error(await answer.text());
  const lines = answer.body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = '';
  for (;;) {
    const { done, value } = await lines.read();
    if (done) return;
    const whole = (rest + value).split('\n');
    rest = whole.pop();
    for (const line of whole.filter(Boolean)) {
      frame = JSON.parse(line);
      [heard, fresh] = [performance.now(), true];
      take();
    }
  }
}

async function connect() {
  for (;;) {
    try {
      const answer = await ask('/scene');
      if (answer.status === 403) {
        trouble = 'The token of this address is not valid any more: a new start prints a new address.';
      } else if (answer.status === 200) {
        set_up(await answer.json());
        await read();
      }
    } catch {
      // Gone: the loop asks again until somebody is there.
    }
    await pause(700);
  }
}

// --- what is shown -----------------------------------------------------------------------------------

function set_up(known) {
  scene = known;
  if (view) view.load(scene);
  find('robot').textContent = scene.robot.replaceAll('_', ' ');
  find('top').max = Math.min(3, scene.limits[0]);
  find('gaits').replaceChildren(...scene.gaits.map((name) => {
    const button = document.createElement('button');
    button.textContent = name;
    button.dataset.gait = name;
    button.addEventListener('click', () => request({ gait: name }));
    return button;
  }));
  for (const button of document.querySelectorAll('button')) button.disabled = !scene.drives;
}

function take() {
  for (const panel of [oscillators, footfalls, speeds]) panel.take(frame);
  if (view) view.take(frame);
}

function show() {
  const silent = !frame || performance.now() - heard > SILENT_MS;
  find('notice').textContent = silent ? (trouble || (frame
    ? 'No news from the suite: it has ended, or stands still.' : 'Waiting for the suite …')) : trouble;
  if (!frame) return;
  const { stop } = frame, state = (stop.state || '').replaceAll('_', ' ');
  find('gait').textContent = frame.gait || '';
  find('mode').textContent = frame.mode;
  find('force').textContent = view && view.push ? `push ${Math.hypot(...view.push).toFixed(0)} N` : '';
  find('clock').textContent = `${frame.time.toFixed(1)} s`;
  find('pace').textContent = `${frame.pace.toFixed(2)} × real time · ${Math.round(frame.pace * scene.rate)} Hz`;
  find('pace').classList.toggle('slow', frame.pace < 0.95);
  find('slow').hidden = frame.pace > 0.75;
  find('state').textContent = state;
  find('why').textContent = frame.requested && stop.automatic === 'true' ? 'or drive' : 'start it again';
  find('inhibit').classList.toggle('idle', Boolean(frame.requested && stop.automatic !== 'true'));
  find('resume').classList.toggle('idle', !frame.requested);
  const lamp = find('certificate');
  lamp.textContent = stop.grade || 'no certificate yet';
  lamp.className = `lamp ${{ true: 'holds', false: 'fails' }[stop.certified] || ''}`;
  for (const each of find('gaits').children) each.classList.toggle('chosen', each.dataset.gait === frame.gait);
  oscillators.draw(frame, scene);
  drawTimes(find('times'), frame);
  footfalls.draw(scene);
  speeds.draw(frame);
}

// --- driving: what is held is sent again and again; nothing held is a zero, once -----------------------

const still = (value) => (Math.abs(value) < 0.08 ? 0 : value);

/** Take what the first gamepad that is laid out as usual says; A inhibits, B resumes. */
function take_gamepad() {
  const found = [...navigator.getGamepads()].find((each) => each && each.mapping === 'standard');
  const buttons = found ? found.buttons.slice(0, 2).map((button) => button.pressed) : [];
  ['inhibit', 'resume'].forEach((name, i) => { if (buttons[i] && !held[i]) find(name).click(); });
  held = buttons;
  gamepad = found ? [1, 0, 2].map((axis) => -still(found.axes[axis]) || 0) : [0, 0, 0];
}

/** Commanded v_x, v_y [m/s] and yaw rate [rad/s]. */
function velocity() {
  const pressed = (...names) => names.some((name) => keys.has(name));
  const axis = (plus, minus) => pressed(...plus) - pressed(...minus);
  const [pad_ahead, pad_aside, pad_around] = gamepad;
  const [turn, forward] = steering || find('hold').checked ? stick : [pad_around, pad_ahead];
  const top = parseFloat(find('top').value), [, most_aside, most_turn] = scene ? scene.limits : [0, 0, 0];
  const ahead = forward || axis(['ArrowUp', 'w'], ['ArrowDown', 's']);
  const around = turn || axis(['ArrowLeft', 'a'], ['ArrowRight', 'd']);
  const going = ahead || around || find('hold').checked;
  const aside = axis(['q'], ['e']) || pad_aside || (going ? parseFloat(find('aside').value) : 0);
  const round = (value) => Math.round(1000 * value) / 1000 || 0;
  return [round(top * ahead), round(Math.min(most_aside, 0.6 * top) * aside),
    round(Math.min(most_turn, 0.4 + 0.8 * top) * around)];
}

async function drive() {
  for (;;) {
    const wanted = velocity(), now_moving = wanted.some(Boolean);
    if (scene && scene.drives && (now_moving || moving)) {
      const answer = await send({ velocity: wanted });
      moving = now_moving || answer === null;
    }
    await pause(SEND_MS);
  }
}

function show_stick() {
  const [v_x, v_y, yaw] = velocity(), pad = find('stick');
  const top = parseFloat(find('top').value);
  const shown = steering || find('hold').checked ? stick
    : gamepad.some(Boolean) ? [gamepad[2], gamepad[0]] : [Math.sign(yaw), v_x / top];
  drawStick(pad, shown, v_x || v_y || yaw);
  find('command').textContent = `${v_x.toFixed(2)} m/s, ${v_y.toFixed(2)} m/s, ${yaw.toFixed(2)} rad/s`;
  find('top_text').textContent = `${top.toFixed(2)} m/s`;
  find('aside_text').textContent = parseFloat(find('aside').value).toFixed(2);
}

function let_go() {
  keys.clear();
  steering = false;
  stick = [0, 0];
  gamepad = [0, 0, 0];
  find('hold').checked = false;
}

function move_stick(event) {
  const pad = find('stick').getBoundingClientRect(), reach = pad.width / 2 - 20;
  const x = (event.clientX - pad.left - pad.width / 2) / reach, y = (event.clientY - pad.top - pad.height / 2) / reach;
  const length = Math.max(1, Math.hypot(x, y));
  stick = [still(-x / length), still(-y / length)];
}

find('stick').addEventListener('pointerdown', (event) => {
  find('stick').setPointerCapture(event.pointerId);
  steering = true;
  move_stick(event);
});
find('stick').addEventListener('pointermove', (event) => { if (steering) move_stick(event); });
for (const name of ['pointerup', 'pointercancel', 'lostpointercapture']) {
  find('stick').addEventListener(name, () => {
    steering = false;
    if (!find('hold').checked) stick = [0, 0];
  });
}
find('hold').addEventListener('change', () => { if (!find('hold').checked) stick = [0, 0]; });
find('aside').addEventListener('dblclick', () => { find('aside').value = 0; });

hear_keys(window, keys, () => find('inhibit').click());
document.addEventListener('visibilitychange', () => { if (document.hidden) let_go(); });

// --- buttons -----------------------------------------------------------------------------------------

find('inhibit').addEventListener('click', () => request({ inhibit: true }));
find('resume').addEventListener('click', () => request({ inhibit: false }));
for (const button of document.querySelectorAll('[data-request]'))
  button.addEventListener('click', () => request({ request: button.dataset.request }));

// --- the mouse over the robot: push, turn, come closer -----------------------------------------------------

const fingers = new Map();
let grip = null;

function pushed(event) {
  const drag = view.ground_drag(event.clientX - grip.x, event.clientY - grip.y);
  const weight = GRAVITY * scene.mass, length = Math.hypot(...drag);
  const force = Math.min(weight, WEIGHTS_PER_HEIGHT * weight * length / scene.height);
  return drag.map((value) => (length > 0 ? value / length * force : 0));
}

async function push() {
  while (grip) {
    if (view.push && view.push.some(Boolean)) await send({ push: view.push });
    await pause(50);
  }
}

if (view) {
  const canvas = find('scene');
  const inside = (event) => {
    const { left, top } = canvas.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  };
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event);
    if (fingers.size === 1 && event.button === 0 && scene && scene.drives && view.robot_at(...inside(event))) {
      grip = { x: event.clientX, y: event.clientY };
      view.push = [0, 0, 0];
      push();
    }
    canvas.classList.add('busy');
  });
  canvas.addEventListener('pointermove', (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) {
      canvas.classList.toggle('on-robot', Boolean(scene && view.robot_at(...inside(event))));
      return;
    }
    if (grip) {
      view.push = pushed(event);
    } else if (fingers.size === 1) {
      view.turn(event.clientX - before.clientX, event.clientY - before.clientY);
    } else {
      const other = [...fingers.values()].find((finger) => finger.pointerId !== event.pointerId);
      const apart = (finger) => Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY) || 1;
      view.zoom(apart(before) / apart(event));
    }
    fingers.set(event.pointerId, event);
    fresh = true;
  });
  for (const name of ['pointerup', 'pointercancel', 'lostpointercapture']) {
    canvas.addEventListener(name, (event) => {
      fingers.delete(event.pointerId);
      if (!fingers.size) {
        grip = view.push = null;
        canvas.classList.remove('busy');
      }
    });
  }
  canvas.addEventListener('wheel', (event) => {
    view.zoom(Math.exp(0.001 * event.deltaY));
    fresh = true;
    event.preventDefault();
  }, { passive: false });
}

// --- the loop ------------------------------------------------------------------------------------------

let last = performance.now();
function loop(now) {
  take_gamepad();
  if (fresh || now - last > 250) {
    fresh = false;
    show();
    show_stick();
    if (view && scene) view.draw((now - last) / 1000);
    last = now;
  }
  requestAnimationFrame(loop);
}

requestAnimationFrame(loop);
connect();
drive();
