// What a study asks whoever is on the page: consent, questionnaires, and the task that is going on.

const LOOK_MS = 1500;

export class Asked {
  /** `path`: of what is asked; empty where no study is going on. */
  constructor(link, parent, path) {
    Object.assign(this, { link, parent, path });
    this.shown = null; // number of the step that is shown
    this.timer = null;
  }

  /** Begins to look, for somebody of a role. */
  begin(role) {
    this.role = role;
    if (this.path === "" || this.timer !== null) return;
    this.timer = setInterval(() => this.#look(), LOOK_MS);
    this.#look();
  }

  async #look() {
    if (!this.link.isOpen || document.hidden) return;
    try {
      const answer = await fetch(this.path, { headers: this.#headers() });
      if (answer.ok) this.#show(await answer.json());
    } catch {
      return; // the connection says so itself, and the next look may find it
    }
  }

  #headers() {
    return { Authorization: `Bearer ${this.link.token}` };
  }

  #show(asked) {
    if (asked.role !== this.role || asked.step === this.shown) return;
    this.shown = asked.step;
    const { parent } = this;
    parent.hidden = false;
    parent.className = asked.kind === "task" ? "task" : "";
    const form = made("form", { noValidate: true });
    form.append(made("h1", { id: "asked-title", textContent: asked.title }));
    for (const text of asked.text) form.append(made("p", { textContent: text }));
    for (const item of asked.items) form.append(question(item));
    const why = made("p", { className: "why", role: "alert" });
    form.append(why);
    if (asked.button) {
      const button = made("button", { className: "main", textContent: asked.button });
      form.append(button);
      form.addEventListener("submit", (event) => {
        event.preventDefault();
        this.#send(asked, form, { button, why });
      });
    }
    parent.replaceChildren(form);
    parent.scrollTop = 0;
    if (asked.kind !== "task") form.querySelector("input, textarea, button")?.focus();
  }

  async #send(asked, form, { button, why }) {
    const answers = asked.kind === "consent" ? { agree: "yes" } : {};
    const missing = [];
    for (const item of asked.items) {
      const value = valueOf(form, item);
      if (value !== "") answers[item.name] = value;
      const isMissing = value === "" && item.needed;
      form.querySelector(`[data-item="${item.name}"]`).classList.toggle("missing", isMissing);
      if (isMissing) missing.push(item);
    }
    if (missing.length > 0) {
      why.textContent = `${missing.length} not answered yet; they are marked.`;
      form.querySelector(".missing").scrollIntoView({ block: "center" });
      return;
    }
    button.disabled = true;
    try {
      const answer = await fetch("/study/answers", { method: "POST",
        headers: { ...this.#headers(), "Content-Type": "application/json" },
        body: JSON.stringify({ step: asked.step, answers }) });
      const said = await answer.json();
      why.textContent = answer.ok ? "" : `Not taken: ${said.why}.`;
    } catch {
      why.textContent = "Not sent: the connection is gone. Try again in a moment.";
    }
    button.disabled = false;
    this.#look();
  }
}

function made(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

/** One question with its answers, as a group that is read aloud as one. */
function question(item) {
  const group = made("fieldset", {}, made("legend", { textContent: item.text }));
  group.dataset.item = item.name;
  const name = `asked-${item.name}`;
  for (const kind of ["input", "change"]) {
    group.addEventListener(kind, () => group.classList.remove("missing"));
  }
  if (item.kind === "text") group.append(made("textarea", { name, rows: 3, maxLength: 4000 }));
  else if (item.kind === "number") {
    group.append(made("input", { name, inputMode: "numeric", maxLength: 6, size: 6 }));
  } else if (item.kind === "scale") group.append(scale(item, name));
  else group.append(choices(item, name));
  group.querySelectorAll("input, textarea").forEach((field) => {
    if (field.type !== "radio") field.setAttribute("aria-label", item.text);
  });
  return group;
}

function choices(item, name) {
  const isLikert = item.kind === "likert";
  const values = isLikert ? Array.from({ length: item.points }, (_, i) => String(i + 1)) : item.options;
  const row = made("div", { className: isLikert ? "points" : "options" });
  if (isLikert) row.append(made("span", { className: "end", textContent: item.low }));
  for (const value of values) {
    const radio = made("input", { type: "radio", name, value });
    row.append(made("label", {}, radio, made("span", { textContent: value })));
  }
  if (isLikert) row.append(made("span", { className: "end", textContent: item.high }));
  return row;
}

/** A scale of 21 marks that has no answer before it is touched. */
function scale(item, name) {
  const slider = made("input", { type: "range", name, min: 0, max: 100, step: 5, value: 50,
    className: "untouched" });
  const shown = made("output", { textContent: "–" });
  const touched = () => {
    slider.className = "";
    shown.textContent = slider.value;
  };
  for (const kind of ["input", "pointerdown", "keydown"]) slider.addEventListener(kind, touched);
  return made("div", { className: "scale" }, made("span", { className: "end", textContent: item.low }),
    slider, made("span", { className: "end", textContent: item.high }), shown);
}

function valueOf(form, item) {
  const fields = [...form.elements].filter((field) => field.name === `asked-${item.name}`);
  const [field] = fields;
  if (field?.type === "radio") return fields.find((radio) => radio.checked)?.value ?? "";
  if (field?.type === "range" && field.className === "untouched") return "";
  return field?.value.trim() ?? "";
}
