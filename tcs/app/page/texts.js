// Texts of the page in the chosen language, and sentences made of them.

let texts = {};

export async function load(language) {
  texts = await (await fetch(`app/${language}.json`)).json();
  document.documentElement.lang = language;
  for (const element of document.querySelectorAll("[data-t]")) element.textContent = t(element.dataset.t);
}

export function t(key, values = {}) {
  const text = key.split(".").reduce((inner, part) => (inner === undefined ? undefined : inner[part]), texts);
  if (typeof text !== "string") return text;
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name] ?? "");
}

export function named(table, name) {
  return t(`${table}.${name}`) ?? name.replaceAll("_", " ");
}

export function goalName(goal) {
  if (goal.given_name) return t(`goalNames.${goal.given_name}`) ?? goal.given_name;
  if (!goal.body_frame) return t("goalNumber", { place: goal.goal });
  return t("goalName", { frame: named("frames", goal.body_frame), place: goal.place });
}

// The name of a body for readers: "left forearm (robot)" of l_forearm_link, "left upper arm (person)" of person::arm_left_link. Without a
// model before it, it is of the robot, or a thing of the scene, as `isThing` says of its name.
export function bodyName(body, isThing) {
  const [name, model = "robot"] = body.split("::").reverse();
  if (name === body && isThing(name.replace(/_[b-e]$/, ""))) return modelName(name.replace(/_[b-e]$/, ""));
  const sides = { l: "left", left: "left", r: "right", right: "right" };
  const words = name.replace(/_link$/, "").split(/[_ ]/).map((word) => sides[word] ?? word);
  const isSide = (word) => word === "left" || word === "right";
  const part = words.filter((word) => !isSide(word)).join(" ");
  const text = t(`bodies.${model}.${part}`) ?? part;
  return t("bodyOf", { side: words.filter(isSide).slice(0, 1).map((word) => `${t(`bodySides.${word}`)} `).join(""), part: text, model: modelName(model) });
}

// The name of a thing of the scene: "chair 2" of chair_2.
export function modelName(name) {
  const [, kind, number] = /^(.*?)(?:_(\d+))?$/.exec(name);
  const text = t(`pieces.${kind}`) ?? named("things", kind);
  return number ? `${text} ${number}` : text;
}

// The name of a goal with its number, by which the map and the command line name it.
export function goalText(goal) {
  const name = goalName(goal);
  return goal.given_name || goal.body_frame ? `${name} (${goal.goal + 1})` : name;
}

export function sentence(outcome) {
  const counts = { reached: outcome.reached, goals: outcome.goals.length };
  if (!outcome.place) return t("shortSentence", counts);
  const { side, beside, facing } = outcome.place;
  return t("sentence", {
    side: t(`side.${side}`),
    beside: beside ? t("beside", { part: t(`parts.${beside}`) }) : "",
    facing: t(`facing.${facing}`),
    ...counts,
  });
}

export function setting(name, value) {
  const axis = name.replace(/_deg$/, "");
  return `${named("settings", axis)} ${name.endsWith("_deg") ? `${+value.toFixed(1)}°` : `${value.toFixed(2)} m`}`;
}

export function changes(fix) {
  const steps = [];
  const cm = (metres) => +(100 * Math.abs(metres)).toFixed(1);
  if (Math.abs(fix.ahead) >= 0.0005) steps.push(t(fix.ahead > 0 ? "forward" : "back", { cm: cm(fix.ahead) }));
  if (Math.abs(fix.left) >= 0.0005) steps.push(t(fix.left > 0 ? "toLeft" : "toRight", { cm: cm(fix.left) }));
  for (const { axis, change, unit } of fix.changes) {
    const name = axis.replace(/_deg$/, "");
    const amount = unit === "deg" ? `${+Math.abs(change).toFixed(1)}°` : `${cm(change)} cm`;
    if (name === "base_x" || name === "base_y" || Math.abs(change) < (unit === "deg" ? 0.05 : 0.0005)) continue;
    if (name === "base_yaw") steps.push(t(change > 0 ? "turnLeft" : "turnRight", { deg: +Math.abs(change).toFixed(1) }));
    else steps.push(t(change > 0 ? "raise" : "lower", { what: named("axes", name), amount }));
  }
  return `${steps.join(", ") || t("nothing")}.`;
}
