// Rows of a list beside the picture: a mark, a name and a word, the whole of it a button.

/** Marks and words of an object's states: shape and word, not colour alone. */
export const STATES = {
  static: ["●", "at rest"],
  tracked: ["▲", "followed"],
  occluded: ["◐", "hidden"],
  lost: ["✕", "lost"],
};

/** A new row at the end of a list. */
export function addRow(list, name, pressed) {
  const item = document.createElement("li");
  const button = document.createElement("button");
  button.title = `Look at ${name}`;
  button.append(...["mark", "name", "state"].map((kind) => {
    const part = document.createElement("span");
    part.className = kind;
    return part;
  }));
  button.children[1].textContent = name;
  button.addEventListener("click", pressed);
  item.append(button);
  list.append(item);
  return item;
}

/** Fills a row anew, where it says something else. */
export function fillRow(item, kind, mark, word) {
  const button = item.firstChild;
  if (button.children[2].textContent === word && item.className === kind) return;
  item.className = kind;
  button.children[0].textContent = mark;
  button.children[2].textContent = word;
}
