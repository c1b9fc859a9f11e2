'use strict';
for (const story of document.querySelectorAll('.story')) {
  const plot = story.querySelector('.plot'), svg = plot.querySelector('svg');
  const [first, top, whole, height] = svg.getAttribute('viewBox').split(' ').map(Number);
  let start = first, width = whole, from = null;
  const mark = document.createElement('div');
  mark.className = 'mark-time';
  plot.append(mark);
  const place = (event) => {
    const box = plot.getBoundingClientRect();
    return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
  };
  const show = (at, wide) => {
    [start, width] = [at, wide];
    svg.setAttribute('viewBox', `${start} ${top} ${width} ${height}`);
    let step = 10 ** Math.floor(Math.log10(width / 8));
    step *= [1, 2, 5, 10].find((factor) => width / (factor * step) <= 9);
    const marks = [];
    for (let k = Math.ceil(start / step); k * step <= start + width; k += 1) {
      const span = document.createElement('span');
      span.style.left = `${100 * (k * step - start) / width}%`;
      span.textContent = `${Number((k * step).toFixed(6))} s`;
      marks.push(span);
    }
    story.querySelector('.times').replaceChildren(...marks);
  };
  plot.onpointerdown = (event) => { from = place(event); plot.setPointerCapture(event.pointerId); };
  plot.onpointermove = (event) => {
    if (from === null) return;
    const to = place(event);
    mark.style.left = `${100 * Math.min(from, to)}%`;
    mark.style.width = `${100 * Math.abs(to - from)}%`;
  };
  plot.onpointerup = (event) => {
    const [a, b] = [from, place(event)].sort((one, other) => one - other);
    from = null;
    mark.style.width = 0;
    if ((b - a) > 0.01 && (b - a) * width > 0.02) show(start + a * width, (b - a) * width);
  };
  plot.onpointercancel = () => { from = null; mark.style.width = 0; };
  plot.ondblclick = () => show(first, whole);
}
for (const image of document.querySelectorAll('figure img')) {
  image.onclick = (event) => {
    const box = image.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width, y = (event.clientY - box.top) / box.height;
    const frame = image.parentElement, large = frame.classList.toggle('large');
    frame.scrollLeft = large ? x * image.clientWidth - frame.clientWidth / 2 : 0;
    frame.scrollTop = large ? y * image.clientHeight - frame.clientHeight / 2 : 0;
  };
}
const unfold = () => {
  const named = document.getElementById(location.hash.slice(1));
  if (named !== null && named.tagName === 'DETAILS') named.open = true;
};
addEventListener('hashchange', unfold);
unfold();
