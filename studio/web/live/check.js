// The self-test: all that the live room needs, with a remedy where it is missing.
import { BLOCKS } from "live/blocks.js";

const list = document.getElementById("checks");
const rows = BLOCKS.map(({ name }) => {
  const [row, mark, text] = ["li", "span", "div"].map((tag) => document.createElement(tag));
  const [title, words, remedy] = ["h2", "p", "p"].map((tag) => document.createElement(tag));
  mark.className = "mark";
  mark.textContent = "…";
  title.textContent = name;
  remedy.className = "remedy";
  text.append(title, words, remedy);
  row.append(mark, text);
  list.append(row);
  return { row, mark, words, remedy };
});

const results = await Promise.all(BLOCKS.map(async ({ look }, i) => {
  const found = await look();
  const { row, mark, words, remedy } = rows[i];
  row.className = found.isFine ? "fine" : found.isNeeded ? "blocked" : "without";
  mark.textContent = found.isFine ? "✓" : found.isNeeded ? "✕" : "–";
  mark.setAttribute("aria-label", found.isFine ? "fine" : found.isNeeded ? "blocked" : "not here");
  mark.setAttribute("role", "img");
  words.textContent = found.words;
  remedy.textContent = found.remedy;
  if (found.link) {
    const link = document.createElement("a");
    [link.href, link.textContent] = found.link;
    remedy.append(link);
  }
  return found;
}));
const stops = results.filter((found) => !found.isFine && found.isNeeded).length;
document.getElementById("verdict").textContent = stops
  ? `${stops} of ${results.length} stand in the way. Do what is said below, then test again.`
  : "Nothing stands in the way of joining.";
document.getElementById("again").addEventListener("click", () => location.reload());
document.documentElement.dataset.state = "ready";
