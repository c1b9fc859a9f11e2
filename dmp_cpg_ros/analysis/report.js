'use strict';
// Calls done([x, y], [x, y]) with the corners of a rectangle that is dragged over an element, as
// shares of it from its upper left; mark() shows the rectangle meanwhile.
const dragged = (area, mark, done) => {
  let from = null;
  const shown = document.createElement('div');
  shown.className = 'mark';
  area.append(shown);
  const place = (event) => {
    const box = area.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height].map(
      (share) => Math.min(1, Math.max(0, share)));
  };
  const corners = (event) => {
    const to = place(event);
    return [from.map((share, k) => Math.min(share, to[k])),
      from.map((share, k) => Math.max(share, to[k]))];
  };
  const end = () => { from = null; shown.style.width = 0; };
  area.onpointerdown = (event) => { from = place(event); area.setPointerCapture(event.pointerId); };
  area.onpointermove = (event) => { if (from !== null) mark(shown.style, ...corners(event)); };
  area.onpointerup = (event) => {
    if (from === null) return;
    const rectangle = corners(event);
    end();
    done(...rectangle);
  };
  area.onpointercancel = end;
};
const percent = (share) => `${100 * share}%`;
for (const story of document.querySelectorAll('.story')) {
  const plot = story.querySelector('.plot'), svg = plot.querySelector('svg');
  const [first, top, whole, height] = svg.getAttribute('viewBox').split(' ').map(Number);
  let start = first, width = whole;
  const show = (at, wide) => {
    [start, width] = [at, wide];
    svg.setAttribute('viewBox', `${start} ${top} ${width} ${height}`);
    let step = 10 ** Math.floor(Math.log10(width / 8));
    step *= [1, 2, 5, 10].find((factor) => width / (factor * step) <= 9);
    const marks = [];
    for (let k = Math.ceil(start / step); k * step <= start + width; k += 1) {
      const span = document.createElement('span');
      span.style.left = percent((k * step - start) / width);
      span.textContent = `${Number((k * step).toFixed(6))} s`;
      marks.push(span);
    }
    story.querySelector('.times').replaceChildren(...marks);
  };
  dragged(plot, (style, [a], [b]) => {
    [style.left, style.width] = [percent(a), percent(b - a)];
  }, ([a], [b]) => {
    if ((b - a) > 0.01 && (b - a) * width > 0.02) show(start + a * width, (b - a) * width);
  });
  plot.ondblclick = () => show(first, whole);
}
const LARGEST = 8;
for (const image of document.querySelectorAll('figure img')) {
  const frame = image.parentElement;
  let scale = 1, left = 0, top = 0;
  // What of the picture is in the frame: its scale, and its upper left corner as shares.
  const show = (larger, x, y) => {
    scale = Math.min(LARGEST, Math.max(1, larger));
    [left, top] = [x, y].map((share) => Math.min(1 - 1 / scale, Math.max(0, share)));
    image.style.transform = `scale(${scale}) translate(${-100 * left}%, ${-100 * top}%)`;
  };
  dragged(frame, (style, [a, above], [b, below]) => {
    [style.left, style.width] = [percent(a), percent(b - a)];
    [style.top, style.height] = [percent(above), percent(below - above)];
  }, ([a, above], [b, below]) => {
    const size = Math.max(b - a, below - above);
    const larger = size > 0.01 ? Math.min(LARGEST, scale / size) : Math.min(LARGEST, 2 * scale);
    show(larger, left + (a + b) / (2 * scale) - 0.5 / larger,
      top + (above + below) / (2 * scale) - 0.5 / larger);
  });
  frame.ondblclick = () => show(1, 0, 0);
}
const unfold = () => {
  const named = document.getElementById(location.hash.slice(1));
  if (named !== null && named.tagName === 'DETAILS') named.open = true;
};
addEventListener('hashchange', unfold);
unfold();
