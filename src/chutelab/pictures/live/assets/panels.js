// Energy bars, the table of numbers, and what is said of a run.

const byId = (id) => document.getElementById(id);

function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

const css = (name) => `var(--energy-${name.replace(/_/g, "-")})`;

class Energies {
  constructor() {
    [this.factor, this.unit] = scaled(usualEnergy, "J");
    byId("energy-title").textContent = `Energy, ${this.unit}`;
    this.bars = ["put-in", "is-now"].map((id) => {
      const parts = {};
      for (const name of Object.keys(SIGNS)) {
        parts[name] = byId(id).appendChild(element("i"));
        parts[name].style.background = css(name);
      }
      return parts;
    });
    this.values = {};
    const body = byId("energy").tBodies[0];
    const row = (name, label, swatch) => {
      const head = element("th", { scope: "row" });
      if (swatch) head.append(element("i"));
      if (swatch) head.firstChild.style.background = css(name);
      head.append(label);
      this.values[name] = element("td");
      return body.appendChild(element("tr", {}, head, this.values[name]));
    };
    for (const { name, label } of data.energies) row(name, label, true);
    row("total", "put in = is now", false).className = "total";
  }

  show(variant, t) {
    const books = variant.offsets && !variant.fault ? booksAt(variant, t) : null;
    const longest = Math.max(usualEnergy, longestBars[variant.index]);
    const { putIn, isNow } = stacks(books || {});
    [putIn, isNow].forEach((values, side) => {
      for (const [name, part] of Object.entries(this.bars[side])) {
        const share = books && longest > 0 ? (100 * values[name]) / longest : 0;
        part.style.width = `${share}%`;
      }
    });
    for (const { name } of data.energies) {
      this.values[name].textContent = !books
        ? "–"
        : name === "residual"
          ? `${scientific(books[name])} J`
          : this.written(books[name]);
    }
    this.values.total.textContent = books ? this.written(sum(putIn)) : "–";
    return books;
  }

  written(value) {
    return minus((Math.round(this.factor * value * 100) / 100 + 0).toFixed(2));
  }
}

class Numbers {
  constructor() {
    const body = byId("numbers").tBodies[0];
    let group = "";
    this.rows = data.figures.map((figure) => {
      if (figure.group !== group) {
        group = figure.group;
        const head = element("th", { scope: "colgroup", colSpan: 3, textContent: group });
        body.append(element("tr", { className: "group" }, head));
      }
      const cells = [element("td"), element("td", { className: "analytic-column" })];
      const rounding = figure.name === "ledger.residual";
      const [factor, unit] =
        figure.unit === "J" && !rounding ? scaled(usualEnergy, "J") : [1, figure.unit];
      const head = element("th", { scope: "row" }, `${figure.label} `);
      if (unit) head.append(element("span", { textContent: unit }));
      const row = body.appendChild(element("tr", {}, head, ...cells));
      if (figure.name === "landing.x") row.className = "key";
      const written = (value) => {
        if (rounding) return scientific(value);
        const shown = factor * value;
        return brief(Math.abs(shown) < 1e-12 ? 0 : shown, 5);
      };
      return { figure, cells, written };
    });
    const known = data.figures.some((figure) => figure.analytic.length);
    for (const cell of document.querySelectorAll(".analytic-column")) cell.hidden = !known;
  }

  show(index) {
    for (const { figure, cells, written } of this.rows) {
      [figure.simulated, figure.analytic].forEach((values, i) => {
        const value = values[index];
        cells[i].textContent = value === null || value === undefined ? "–" : written(value);
      });
    }
  }

  /** What is shown, with all digits, for a spreadsheet. */
  text(values, index) {
    const lines = data.sliders.map((slider, i) => [slider.key, values[i], "", slider.unit]);
    for (const { figure } of this.rows) {
      lines.push([
        [figure.group, figure.label].filter(Boolean).join(": "), figure.simulated[index] ?? "", figure.analytic[index] ?? "", figure.unit,
      ]);
    }
    return lines.map((line) => line.join("\t")).join("\n") + "\n";
  }

  /** All variants as a table with a header line. */
  csv(valuesOf) {
    const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);
    const unit = (text) => (text ? ` (${text})` : "");
    const columns = data.figures.flatMap((figure) => [
      [`${figure.name}${unit(figure.unit)}`, figure.simulated],
      ...(figure.analytic.length
        ? [[`${figure.name} analytic${unit(figure.unit)}`, figure.analytic]]
        : []),
    ]);
    const header = [
      ...data.sliders.map((slider) => `${slider.key}${unit(slider.unit)}`),
      ...columns.map(([name]) => name),
      "fault",
    ];
    const lines = variants.map((variant, i) => [
      ...valuesOf(i), ...columns.map(([, values]) => values[i] ?? ""), variant.fault,
    ]);
    return [header, ...lines].map((line) => line.map((v) => quoted(String(v))).join(",")).join("\n") + "\n";
  }
}

const figureOf = (name, index) => {
  const found = data.figures.find((figure) => figure.name === name);
  return found ? (found.simulated[index] ?? null) : null;
};

/** A run in one or two sentences. */
function summaryOf(variant, values) {
  const set = data.sliders
    .map((slider, i) => `${slider.label}: ${withUnit(brief(values[i]), slider.unit)}.`)
    .join(" ");
  if (variant.fault) return `${set} ${variant.fault}.`.trim();
  const value = (name) => figureOf(name, variant.index);
  const who = variant.count > 1 ? "The first particle" : "The particle";
  const parts = [];
  if (value("separation.t") !== null) parts.push(`leaves the pulley at ${brief(value("separation.t"), 3)} s`);
  if (value("impact.t") !== null) {
    const speed = value("v2") === null ? "" : ` with ${brief(value("v2"), 3)} m/s`;
    parts.push(`strikes the plate at ${brief(value("impact.t"), 3)} s${speed}`);
  } else if (variant.segments.some((segment) => segment.name === "plate")) {
    parts.push("misses the plate");
  }
  if (value("landing.t") !== null) {
    parts.push(`lands at x = ${brief(value("landing.x"), 3)} m at ${brief(value("landing.t"), 3)} s`);
  }
  for (const { name } of data.figures) {
    const free = name.match(/^impact\.(.+)\.t$/);
    if (free && value(name) !== null) parts.push(`strikes “${free[1]}” at ${brief(value(name), 3)} s`);
  }
  const over = variant.offsets[1] - 1;
  if (variant.ended[0] === "exit") parts.push("leaves the scene");
  if (variant.ended[0] === "settled") parts.push(`has settled at ${brief(knots.t[over], 3)} s`);
  if (!parts.length) parts.push("ends its way");
  const last = parts.pop();
  const did = parts.length ? `${parts.join(", ")} and ${last}` : last;
  const landed = value("landing.count");
  const crowd = variant.count > 1 && landed !== null ? ` ${landed} of ${variant.count} particles land.` : "";
  return `${set} ${who} ${did}.${crowd}`.trim();
}
