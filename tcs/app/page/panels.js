// The answer beside the map: goals, explanations, suggested places, and the details for experts.

import { IN_SOME_FILES } from "./map.js";
import { changes, goalName, goalText, named, setting, t } from "./texts.js";

const SPEED = 0.2; // at which the time to drive is given [m/s]: slow, beside a person

export const by = (id) => document.getElementById(id);

export function made(name, text, parent, attributes = {}) {
  const element = document.createElement(name);
  if (text !== undefined) element.textContent = text;
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent?.append(element);
  return element;
}

export function options(select, pairs, chosen) {
  select.replaceChildren();
  for (const [value, text] of pairs) made("option", text, select, { value });
  if (pairs.some(([value]) => String(value) === String(chosen))) select.value = chosen;
}

export function showGoals(outcome, onWhy, onFix) {
  const list = by("goals");
  list.replaceChildren();
  for (const goal of outcome.goals) {
    const item = made("li", undefined, list);
    made("span", goal.reached ? "✓" : "✗", item, { class: `mark ${goal.reached ? "yes" : "no"}`, "aria-hidden": "true" });
    const name = made("span", goalText(goal), item, { class: "name" });
    made("span", t(`reasons.${goal.reason}`), name, { class: "reason" });
    if (goal.reached) continue;
    const about = { goal: goalName(goal) };
    made("button", t("why"), item, { type: "button", "aria-label": t("whyOf", about) }).onclick = () => onWhy(goal);
    made("button", t("apply"), item, { type: "button", "aria-label": t("applyOf", about) }).onclick = () => onFix(goal);
  }
}

// `touching` are the names of the bodies that would touch, if any.
export function showWhy(goal, explanation, goals, touching, onFix) {
  const card = by("why");
  card.hidden = false;
  card.replaceChildren();
  const name = goalName(goal);
  made("h3", t("whyOf", { goal: name }), card);
  made("p", t("whyAnswer", { reason: t(`reasons.${explanation.explained.reason}`) }), card);
  if (touching.length) made("p", touching.join(" – "), card);
  const fix = explanation.nearest_reaching;
  if (!fix) {
    made("p", t("noFix"), card);
  } else {
    const isLosing = fix.lost_goals.length > 0;
    made("p", t(isLosing ? "fixLosing" : "fix", { change: changes(fix) }), card);
    if (isLosing) {
      made("p", t("loses", { goals: fix.lost_goals.map((number) => goalName(goals[number])).join("; ") }), card);
    }
    made("button", t(isLosing ? "applyLosing" : "apply"), card, { type: "button" }).onclick = () => onFix(fix);
  }
  card.focus();
}

// What a set of several places gains over fewer, in words.
function gainOf({ fewer, members, ...choice }) {
  const digits = { success: (value) => (100 * value).toFixed(1), reachability: (value) => (100 * value).toFixed(1), manipulability: (value) => value.toFixed(3) };
  const gains = Object.entries(digits)
    .filter(([name]) => choice[name] !== undefined && fewer[name] !== undefined)
    .map(([name, text]) => ({ name, after: text(choice[name]), before: text(fewer[name]) }))
    .filter(({ after, before }) => after !== before)
    .map(({ name, ...values }) => t(`gains.${name}`, values));
  return gains.length ? t("gain", { count: members.length, fewer: fewer.members.length, gains: gains.join(", ") }) : "";
}

// The distance to drive and the time for it, both rounded up to what is shown.
function travelOf(cost) {
  const metres = Math.ceil(10 * cost - 1e-6) / 10;
  return metres > 0 ? t("travel", { metres: metres.toFixed(1), seconds: Math.ceil(metres / SPEED - 1e-6), speed: SPEED }) : t("there");
}

// `choices` are sets of places, the recommended one first.
export function showCards(choices, onGo, onShow) {
  const cards = by("cards");
  cards.replaceChildren();
  if (!choices.length) made("p", t("noAlternative"), cards);
  choices.forEach((choice, number) => {
    const card = made("div", undefined, cards, { class: "card" });
    const percent = Math.round(100 * choice.reachability);
    const count = choice.members.length;
    made("h3", t(count === 1 ? "onePlace" : "places", { count, percent }), card);
    if (number === 0) made("p", t(`recommended.${choice.basis}`), card, { class: "recommended" });
    if (choice.fewer) made("p", gainOf(choice), card);
    made("p", travelOf(choice.cost), card);
    const axes = choice.moves.map((axis) => named("settings", axis)).join(", ");
    made("p", axes ? t("moves", { axes }) : t("unmoved"), card);
    if (choice.success !== undefined) {
      const [success, low, high] = [choice.success, ...choice.success_ci95].map((value) => (100 * value).toFixed(1));
      made("p", t("successOf", { success, low, high }), card);
    }
    if (choice.refined !== undefined) made("p", t("refinedSet"), card);
    card.onpointerenter = () => onShow(choice);
    choice.members.forEach((member, i) => {
      if (member.window) {
        const { x, y, yaw_deg: yaw } = member.window;
        // Rounded down: nothing is promised that was not checked.
        const [cm, deg] = [(half) => Math.floor(100 * half + 1e-6), Math.floor(yaw + 1e-6)];
        made("p", t("window", { number: i + 1, x: cm(x), y: cm(y), yaw: deg }), card);
      }
      const button = made("button", t("go", { number: i + 1 }), card, { type: "button" });
      button.onclick = () => onGo(member);
      button.onfocus = () => onShow(choice);
    });
  });
}

// The colours that the floors of a file can have: two always, the others where the file has them.
export function offerColours(floors) {
  const select = by("score-of");
  for (const [name, text] of [["success", "bySuccess"], ["motion", "byMotion"]]) {
    const option = select.querySelector(`[value=${name}]`);
    option.disabled = !floors.some((floor) => floor?.[name]);
    option.textContent = option.disabled ? t("notInFile", { what: t(text) }) : t(text);
    if (option.disabled && select.value === name) select.value = "reachability";
  }
}

export function showLegend(score) {
  const list = by("legend");
  list.replaceChildren();
  const scale = made("li", undefined, list);
  scale.append(`${t(`legend.${score}.low`)} `);
  made("span", undefined, scale, { class: "scale" });
  scale.append(t(`legend.${score}.high`));
  for (const name of [IN_SOME_FILES.includes(score) ? "unknown" : "zero", "blocked", "outside", "person", "furniture", "goal"]) {
    const item = made("li", undefined, list);
    made("span", undefined, item, { class: name });
    item.append(t(`legend.${name}`));
  }
}

export function showStates(floors, score, state, paint, onState) {
  const list = by("states");
  list.replaceChildren();
  by("environmentStates").hidden = floors.length < 2;
  if (floors.length < 2) return;
  floors.forEach((floor, i) => {
    const text = Object.entries(floor.states[i]).map(([name, value]) => setting(name, value)).join(", ");
    const button = made("button", undefined, list, { type: "button", "aria-pressed": i === state });
    paint(made("canvas", undefined, button, { "aria-hidden": "true" }), floor, score);
    for (const part of text.split(", ")) made("span", part, button);
    button.onclick = () => onState(i);
  });
}

export function showExpert(outcome, command) {
  by("figures").textContent = t("figures", {
    reachability: outcome.reachability.toFixed(3),
    manipulability: outcome.manipulability.toFixed(3),
    measure: outcome.measure,
    configuration: outcome.configuration,
  });
  by("command").textContent = command;
  by("json").textContent = JSON.stringify(outcome, null, 1);
}
