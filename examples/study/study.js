// SPDX-License-Identifier: Apache-2.0
// The study of Sujar18 figure 10: pictures in random order, one answer each from 1 to 8. What was answered is kept in this browser, so that
// a page that is closed goes on where it was; it leaves only as a file that the person saves.
"use strict";

const KEY = "ecorche-study-1", MOST = 8;
const element = (id) => document.getElementById(id);

/** All orders alike: Fisher and Yates, with numbers that are not biased by a remainder. */
function shuffled(count) {
  const order = Array.from({ length: count }, (_, i) => i);
  for (let i = count - 1; i > 0; --i) {
    const bound = i + 1, last = Math.floor(2 ** 32 / bound) * bound;
    let draw;
    do draw = crypto.getRandomValues(new Uint32Array(1))[0]; while (draw >= last);
    const j = draw % bound;
    [order[i], order[j]] = [order[j], order[i]];
  }
  return order;
}

/** A run that fits these pictures, or null. */
function kept() {
  try {
    const run = JSON.parse(localStorage.getItem(KEY));
    const fits = typeof run.person === "string" && run.order.length === PICTURES.length && [...run.order].sort((a, b) => a - b).every((n, i) => n === i)
      && run.answers.length <= run.order.length && run.answers.every((answer) => Number.isInteger(answer) && answer >= 1 && answer <= MOST);
    return fits ? run : null;
  } catch {
    return null;
  }
}

let run = kept();

function keep() {
  localStorage.setItem(KEY, JSON.stringify(run));
}

function begin() {
  const name = crypto.getRandomValues(new Uint32Array(2));
  run = { person: [...name].map((part) => part.toString(16).padStart(8, "0")).join(""), order: shuffled(PICTURES.length), answers: [] };
  keep();
  show();
}

function show() {
  const at = run ? run.answers.length : 0;
  element("start").hidden = run !== null;
  element("question").hidden = run === null || at === PICTURES.length;
  element("end").hidden = run === null || at < PICTURES.length;
  element("count").textContent = String(PICTURES.length);
  if (element("question").hidden) return;
  element("progress").textContent = `Picture ${at + 1} of ${PICTURES.length}`;
  element("picture").src = PICTURES[run.order[at]].file;
  document.querySelector("form").reset();
  element("next").disabled = true;
}

function next(event) {
  event.preventDefault();
  const chosen = document.querySelector("input[name=answer]:checked");
  if (!chosen) return;
  run.answers.push(Number(chosen.value));
  keep();
  show();
}

function table() {
  const rows = run.answers.map((answer, at) => {
    const { pose, view, method } = PICTURES[run.order[at]];
    return [run.person, at + 1, pose, view, method, answer].join(",");
  });
  return ["person,order,pose,view,method,answer", ...rows].join("\n") + "\n";
}

function save() {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([table()], { type: "text/csv" }));
  link.download = `answers_${run.person}.csv`;
  link.click();
  URL.revokeObjectURL(link.href);
}

function again() {
  localStorage.removeItem(KEY);
  run = null;
  show();
}

for (let value = 1; value <= MOST; ++value) {
  const label = document.createElement("label"), input = document.createElement("input");
  Object.assign(input, { type: "radio", name: "answer", value: String(value) });
  input.addEventListener("change", () => { element("next").disabled = false; });
  label.append(input, String(value));
  element("scale").append(label);
}
element("begin").addEventListener("click", begin);
document.querySelector("form").addEventListener("submit", next);
element("save").addEventListener("click", save);
element("again").addEventListener("click", again);
show();
