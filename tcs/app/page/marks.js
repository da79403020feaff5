// Marks of goals that are close together share one, with all their numbers.

export const MARKS = { reached: "#00613f", unreached: "#a3210f" };

// Returns groups {at, reached, text, wide} of marks {at, reached, number} that are nearer than `apart` and alike; `at` is the middle, and
// `wide` how many times as wide as high a badge for the text is.
export function grouped(marks, apart) {
  const groups = [];
  for (const mark of marks) {
    const near = groups.find(({ first, reached }) => reached === mark.reached && Math.hypot(first[0] - mark.at[0], first[1] - mark.at[1]) < apart);
    if (near) near.all.push(mark);
    else groups.push({ first: mark.at, reached: mark.reached, all: [mark] });
  }
  return groups.map(({ reached, all }) => {
    const text = all.map(({ number }) => number + 1).join(" ");
    const at = [0, 1].map((k) => all.reduce((sum, { at }) => sum + at[k], 0) / all.length);
    return { reached, at, text, wide: Math.max(1, 0.6 * text.length) };
  });
}

// Moves the middle of a badge that the edge would cut.
export const whole = (middle, half, low, high) => (middle < low || middle > high ? middle : Math.min(Math.max(middle, low + half), high - half));
