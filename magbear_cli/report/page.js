"use strict";
// Without these scripts the page is whole: all rows, in the study's order, and every figure with its numbers as CSV.

// Reading a value off a figure: where the pointer is, in the units of the panel's axes.
(function () {
  // A place on an axis in words: three digits where it is logarithmic, else to about a thousandth of its length.
  function told(part, low, high, logarithmic) {
    if (logarithmic) { return String(Number((low * Math.pow(high / low, part)).toPrecision(3))); }
    const digits = Math.max(0, 2 - Math.floor(Math.log10(Math.abs(high - low))));
    return (low + part * (high - low)).toFixed(digits).replace(/^-(0(?:\.0*)?)$/, "$1");
  }

  document.querySelectorAll(".paper > svg[data-panels]").forEach(function (picture) {
    const panels = JSON.parse(picture.dataset.panels), paper = picture.parentElement;
    if (!panels.length) { return; }
    const reading = document.createElement("output");
    reading.className = "reading";
    reading.hidden = true;
    paper.append(reading);
    paper.addEventListener("pointermove", function (event) {
      const box = picture.getBoundingClientRect();
      const x = (event.clientX - box.left) / box.width, y = 1 - (event.clientY - box.top) / box.height;
      const panel = panels.find(function (p) { return x >= p[0] && x <= p[2] && y >= p[1] && y <= p[3]; });
      reading.hidden = !panel;
      if (!panel) { return; }
      const across = told((x - panel[0]) / (panel[2] - panel[0]), panel[4], panel[5], panel[6]);
      const up = told((y - panel[1]) / (panel[3] - panel[1]), panel[8], panel[9], panel[10]);
      reading.textContent = [[panel[7], across], [panel[11], up]]
        .filter(function (side) { return side[0]; })
        .map(function (side) { return side[0] + ": " + side[1]; }).join("   ");
    });
    paper.addEventListener("pointerleave", function () { reading.hidden = true; });
  });
}());

// Sorting and filtering of the table of cases.
(function () {
  const table = document.querySelector("table.cases");
  if (!table || table.tBodies[0].rows.length < 2) { return; }
  const body = table.tBodies[0];
  const rows = Array.from(body.rows);
  const heads = Array.from(table.tHead.rows[0].cells);
  const names = heads.map(function (head) {
    const copy = head.cloneNode(true);
    copy.querySelectorAll("small").forEach(function (small) { small.remove(); });
    return copy.textContent.trim();
  });
  let sorted = { column: -1, falls: false };

  function element(name, properties, parent) {
    const made = Object.assign(document.createElement(name), properties);
    parent.append(made);
    return made;
  }

  // The first number of a cell; a cell without one goes last, whichever way it is sorted.
  function value(row, column) {
    const text = row.cells[column].textContent.replace(/[\u00a0\u2009\u202f]/g, "").replace(/\u2212/g, "-").trim();
    const found = text.match(/-?\d+(?:\.\d+)?(?:e[-+]?\d+)?/i);
    return found ? { number: parseFloat(found[0]), text: text } : { number: NaN, text: text };
  }

  function sort(column, falls) {
    sorted = { column: column, falls: falls };
    const sign = falls ? -1 : 1;
    const counted = heads[column] && heads[column].classList.contains("number");
    const order = rows.map(function (row, place) { return [row, place]; });
    if (column >= 0) {
      order.sort(function (one, other) {
        const a = value(one[0], column), b = value(other[0], column);
        let found = 0;
        if (counted) {
          if (isNaN(a.number) !== isNaN(b.number)) { return isNaN(a.number) ? 1 : -1; }
          found = isNaN(a.number) ? 0 : a.number - b.number;
        } else {
          found = a.text.localeCompare(b.text, "en");
        }
        return sign * found || one[1] - other[1];
      });
    }
    body.append.apply(body, order.map(function (pair) { return pair[0]; }));
    heads.forEach(function (head, place) {
      head.setAttribute("aria-sort", place === column ? (falls ? "descending" : "ascending") : "none");
    });
    chooser.value = String(column);
  }

  const tools = element("form", { className: "tools" }, document.createDocumentFragment());
  tools.addEventListener("submit", function (event) { event.preventDefault(); });
  const search = element("label", { textContent: "show cases with " }, tools);
  const words = element("input", { type: "search", size: 18 }, search);
  const states = Array.from(new Set(rows.map(function (row) { return row.dataset.status; })));
  const stateLabel = element("label", { textContent: "status " }, tools);
  const state = element("select", {}, stateLabel);
  element("option", { value: "", textContent: "any" }, state);
  states.forEach(function (name) { element("option", { value: name, textContent: name.replace("_", " ") }, state); });
  const orderLabel = element("label", { textContent: "sort by " }, tools);
  const chooser = element("select", {}, orderLabel);
  element("option", { value: "-1", textContent: "the study's order" }, chooser);
  names.forEach(function (name, place) { element("option", { value: String(place), textContent: name }, chooser); });
  const turn = element("button", { type: "button", textContent: "reverse" }, tools);
  const count = element("output", {}, tools);
  count.setAttribute("aria-live", "polite");

  function filter() {
    const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    rows.forEach(function (row) {
      const text = row.textContent.toLowerCase();
      const fits = wanted.every(function (word) { return text.includes(word); })
        && (!state.value || row.dataset.status === state.value);
      row.hidden = !fits;
      shown += fits ? 1 : 0;
    });
    count.textContent = shown + " of " + rows.length + " cases";
  }

  heads.forEach(function (head, place) {
    head.classList.add("sortable");
    head.tabIndex = 0;
    const toggle = function () { sort(place, sorted.column === place && !sorted.falls); };
    head.addEventListener("click", toggle);
    head.addEventListener("keydown", function (event) {
      if (event.key === "Enter" || event.key === " ") { event.preventDefault(); toggle(); }
    });
  });
  words.addEventListener("input", filter);
  state.addEventListener("change", filter);
  chooser.addEventListener("change", function () { sort(Number(chooser.value), false); });
  turn.addEventListener("click", function () { sort(sorted.column, !sorted.falls); });
  table.before(tools);
  filter();

  // A link to a case opens it.
  function openTarget() {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (target && target.tagName === "DETAILS") { target.open = true; target.scrollIntoView(); }
  }
  window.addEventListener("hashchange", openTarget);
  openTarget();
}());
