// Copyright 2026 The dmp_cpg_ros authors
// SPDX-License-Identifier: Apache-2.0
// The keyboard: arrows and letters drive while they are held, the space bar stops.

const DRIVING = ['ArrowUp', 'ArrowDown', 'ArrowLeft', 'ArrowRight', 'w', 'a', 's', 'd', 'q', 'e'];

/** Name of a key: that of a letter does not depend on Shift and Caps Lock. */
const key_of = (event) => (event.key.length === 1 ? event.key.toLowerCase() : event.key);

/** Keep in a set which driving keys of a window are held, and stop at the space bar, whatever has the focus. */
export function hear_keys(window, held, stop) {
  window.addEventListener('keydown', (event) => {
    if (event.key === ' ') {  // the page has no field in which one writes
      if (!event.repeat) stop();
      event.preventDefault();
    } else if (DRIVING.includes(key_of(event)) && event.target.type !== 'range'
               && !event.ctrlKey && !event.metaKey && !event.altKey) {
      held.add(key_of(event));
      event.preventDefault();
    }
  });
  window.addEventListener('keyup', (event) => {
    // A button that has the focus is pressed when the space bar is released.
    if (event.key === ' ') event.preventDefault();
    // Of a key that is released while Meta is held a Mac tells nothing.
    if (event.key === 'Meta') held.clear();
    held.delete(key_of(event));
  });
  window.addEventListener('blur', () => held.clear());
  // What was clicked or dragged lets the keys go: arrows drive again, and move no slider.
  window.addEventListener('pointerup', () => window.document.activeElement?.blur());
}
