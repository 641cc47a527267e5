// Making elements.

type Child = Node | string | null | undefined | false;

/** An element with properties, listeners (`onclick`) and children. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Record<string, unknown> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) {
      element.addEventListener(name.slice(2), value as EventListener);
    } else if (name in element && name !== "list" && name !== "role") {
      (element as unknown as Record<string, unknown>)[name] = value;
    } else {
      element.setAttribute(name, value === true ? "" : String(value));
    }
  }
  for (const child of children) if (child) element.append(child);
  return element;
}

const CONTROLS = "button, input, select, a[href]";

/** Puts children in place of what an element holds; the control that had the focus has it again. */
export function fill(element: HTMLElement, ...children: Child[]): void {
  const held = element.contains(document.activeElement)
    ? [...element.querySelectorAll(CONTROLS)].indexOf(document.activeElement!)
    : -1;
  element.replaceChildren(...children.filter((child): child is Node | string => Boolean(child)));
  if (held < 0) return;
  const again = element.querySelectorAll<HTMLElement>(CONTROLS)[held];
  again?.focus({ preventScroll: true });
}

/** An SVG element. */
export function svg(tag: string, attributes: Record<string, string | number> = {}, ...children: Child[]): SVGElement {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  for (const child of children) if (child) element.append(child);
  return element;
}

let labels = 0;

/** A control with its label before it. */
export function labelled(label: string, control: HTMLElement): HTMLElement {
  if (!control.id) control.id = `control-${++labels}`;
  return h("div", { className: "field" }, h("label", { htmlFor: control.id }, label), control);
}

export function button(label: string, act: () => void, more: Record<string, unknown> = {}) {
  return h("button", { type: "button", onclick: act, ...more }, label);
}

/** Runs `act` once at the next painted frame, however often it is asked for. */
export function coalesced(act: () => void): () => void {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      act();
    });
  };
}

/** A share in words. */
export const percent = (share: number) => `${Math.round(100 * share)} %`;

/** Gives the keyboard back to the window when a control was used by pointer: arrows scrub again. */
function release(control: HTMLElement): void {
  control.addEventListener("change", () => {
    if (!control.matches(":focus-visible")) control.blur();
  });
}

/** A slider with its label and its value, in the words of `told`. */
export function slider(
  label: string,
  value: number,
  range: { min: number; max: number; step: number },
  change: (value: number) => void,
  told: (value: number) => string = String,
  id = `control-${++labels}`,
): HTMLElement {
  const output = h("output", {}, told(value));
  const input = h("input", {
    type: "range",
    id,
    ...Object.fromEntries(Object.entries(range).map(([k, v]) => [k, String(v)])),
    oninput: () => {
      output.textContent = told(Number(input.value));
      change(Number(input.value));
    },
  });
  input.value = String(value);
  release(input);
  const head = h("div", { className: "head" }, h("label", { htmlFor: input.id }, label), output);
  return h("div", { className: "field" }, head, input);
}

/** Controls that belong together, under a label. */
export function group(label: string, ...controls: HTMLElement[]): HTMLElement {
  const id = `control-${++labels}`;
  return h(
    "div",
    { className: "field" },
    h("span", { id, className: "label" }, label),
    h("div", { className: "picks", role: "group", "aria-labelledby": id }, ...controls),
  );
}

export function choice(
  label: string,
  value: string,
  options: [string, string][],
  change: (value: string) => void,
): HTMLElement {
  const select = h(
    "select",
    { onchange: (event: Event) => change((event.target as HTMLSelectElement).value) },
    ...options.map(([v, text]) => h("option", { value: v, selected: v === value }, text)),
  );
  release(select);
  return labelled(label, select);
}

export function checkbox(label: string, value: boolean, change: (value: boolean) => void) {
  const input = h("input", {
    type: "checkbox",
    checked: value,
    onchange: (event: Event) => change((event.target as HTMLInputElement).checked),
  });
  return h("label", { className: "check" }, input, label);
}
