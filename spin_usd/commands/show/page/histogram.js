"use strict";
// Histograms: of all pictures, of those that are selected, and of another dataset's.

/** Return the least and greatest of the numbers, of all these arrays; null where there is none. */
function extent(...arrays) {
    let low = Infinity,
        high = -Infinity;
    for (const numbers of arrays) {
        for (const number of numbers) {
            if (number < low) low = number;
            if (number > high) high = number;
        }
    }
    return low <= high ? [low, high] : null;
}

/** Return how many of the rows' numbers lie in each of so many bins from low to high. */
function counts(numbers, rows, [low, high], bins) {
    const found = new Float64Array(bins);
    const scale = high > low ? bins / (high - low) : 0;
    for (const row of rows ?? numbers.keys()) {
        const bin = Math.floor((numbers[row] - low) * scale);
        if (bin >= 0) found[Math.min(bin, bins - 1)] += 1;
    }
    return found;
}

/** Draw bars of heights 0 to 1 as one path in a box of that width and height. */
function bars(heights, width, height) {
    const step = width / heights.length;
    let path = `M0 ${height}`;
    heights.forEach((each, bin) => {
        const y = (height * (1 - each)).toFixed(2);
        path += `L${(bin * step).toFixed(2)} ${y}L${((bin + 1) * step).toFixed(2)} ${y}`;
    });
    return `${path}L${width} ${height}Z`;
}

/** Return the end of a range as it is typed; "" for an endless one. */
function endText(end) {
    return Number.isFinite(end) ? String(end) : "";
}

/** The range of one measure that is let pass: a histogram to drag over, and its two ends to type. */
class RangeFilter {
    constructor(selection, name, title, unit, numbers) {
        Object.assign(this, { selection, name, numbers });
        this.extent = extent(numbers) ?? [0, 0];
        this.chart = shape("svg", {
            viewBox: "0 0 100 28",
            preserveAspectRatio: "none",
            class: "spread",
            role: "img",
            "aria-label": `Histogram of ${title}; drag over it to choose a range`,
        });
        this.low = this.input(`Least ${title}`, this.extent[0]);
        this.high = this.input(`Greatest ${title}`, this.extent[1]);
        const label = element("legend", {}, title + (unit ? `, ${unit}` : ""));
        this.node = element(
            "fieldset",
            {},
            label,
            this.chart,
            element("div", { className: "ends" }, this.low, this.high),
        );
        this.chart.addEventListener("pointerdown", (event) => this.drag(event));
        this.draw();
    }

    input(label, placeholder) {
        const found = element("input", {
            type: "number",
            step: "any",
            placeholder: shown(placeholder, 4),
            "aria-label": label,
        });
        found.addEventListener("change", () => this.apply());
        return found;
    }

    apply() {
        const [low, high] = [this.low, this.high].map((input) => (input.value === "" ? null : Number(input.value)));
        this.selection.setRange(this.name, this.numbers, low, high);
    }

    drag(event) {
        const box = this.chart.getBoundingClientRect();
        const [least, greatest] = this.extent;
        const span = greatest - least;
        const step = 10 ** (Math.floor(Math.log10(span)) - 3); // ends are rounded outwards, to texts of few digits
        const at = (moved) => (moved.clientX - box.left) / box.width;
        const text = (share, round) => {
            if (!(share > 0 && share < 1 && span > 0)) return ""; // at an edge no picture is left out
            return String(Number((round((least + share * span) / step) * step).toPrecision(12)));
        };
        const begun = at(event);
        const move = (moved) => {
            const [from, to] = [begun, at(moved)].sort((a, b) => a - b);
            this.low.value = text(from, Math.floor);
            this.high.value = text(to, Math.ceil);
            this.drawChart();
        };
        this.chart.setPointerCapture(event.pointerId);
        this.chart.onpointermove = move;
        this.chart.onpointerup = (moved) => {
            this.chart.onpointermove = this.chart.onpointerup = null;
            if (Math.abs(moved.clientX - event.clientX) < 3) this.low.value = this.high.value = ""; // a click
            this.apply();
        };
    }

    /** Show the range that the selection has. */
    draw() {
        const { low, high } = this.selection.ranges.get(this.name) ?? { low: -Infinity, high: Infinity };
        this.low.value = endText(low);
        this.high.value = endText(high);
        this.drawChart();
    }

    /** Draw all pictures pale, those selected full, and shade what is chosen. */
    drawChart() {
        const all = counts(this.numbers, null, this.extent, 40);
        const some = counts(this.numbers, this.selection.rows, this.extent, 40);
        const most = Math.max(...all, 1);
        const [least, greatest] = this.extent;
        const place = (value, otherwise) =>
            value === "" ? otherwise : 100 * Math.min(Math.max((value - least) / (greatest - least || 1), 0), 1);
        const [from, to] = [place(this.low.value, 0), place(this.high.value, 100)];
        const width = this.low.value || this.high.value ? Math.max(to - from, 0) : 0;
        this.chart.replaceChildren(
            shape("rect", { x: from, y: 0, width, height: 28, class: "chosen" }),
            shape("path", {
                d: bars(
                    [...all].map((each) => each / most),
                    100,
                    28,
                ),
                class: "all",
            }),
            shape("path", {
                d: bars(
                    [...some].map((each) => each / most),
                    100,
                    28,
                ),
                class: "some",
            }),
        );
    }
}
