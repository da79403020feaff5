// Marks of goals that are close together share one, with all their numbers.

export const MARKS = { reached: "#00613f", unreached: "#a3210f" };

// Returns groups {at, reached, text} of marks {at, reached, number} that are nearer than `apart` and alike; `at` is the middle.
export function grouped(marks, apart) {
  const groups = [];
  for (const mark of marks) {
    const near = groups.find(({ first, reached }) => reached === mark.reached && Math.hypot(first[0] - mark.at[0], first[1] - mark.at[1]) < apart);
    if (near) near.all.push(mark);
    else groups.push({ first: mark.at, reached: mark.reached, all: [mark] });
  }
  return groups.map(({ reached, all }) => ({
    reached,
    at: [0, 1].map((k) => all.reduce((sum, { at }) => sum + at[k], 0) / all.length),
    text: all.map(({ number }) => number + 1).join(" "),
    count: all.length,
  }));
}
