"use strict";
// Distributions over the selected pictures, beside those of another dataset.

const BINS = 40;
const HISTOGRAMS = ["range", "sun", "brightness", "visible"]; // measures, by the first part of their names

/** The numbers of a plot: of the selected pictures here, and of all of the other dataset. */
class Source {
    constructor(gallery, rows) {
        Object.assign(this, { gallery, rows });
    }

    /** Return the measure's numbers of the selected pictures. */
    own(name) {
        const numbers = this.gallery.numbers.get(name);
        return numbers && Float32Array.from(this.rows, (row) => numbers[row]);
    }

    /** Return the measure's numbers of the dataset beside; undefined where there is none. */
    beside(name) {
        return this.gallery.numbers.get(`beside ${name}`);
    }
}

class Distributions {
    constructor(gallery, selection, node) {
        Object.assign(this, { gallery, selection, node, target: 1 });
        this.about = element("p", { className: "about" });
        this.cards = element("div", { className: "cards" });
        this.choice = element(
            "select",
            { "aria-label": "Target" },
            ...gallery.targets.map(({ name }, place) => element("option", { value: place + 1 }, name)),
        );
        this.choice.hidden = gallery.targets.length < 2;
        this.choice.addEventListener("change", () => {
            this.target = Number(this.choice.value);
            this.draw();
        });
        const legend = element("p", { className: "legend" }, element("span", { className: "own" }), gallery.dataset);
        if (gallery.beside) legend.append(element("span", { className: "other" }), gallery.beside.dataset);
        this.node.append(element("div", { className: "tools head" }, this.about, this.choice, legend), this.cards);
    }

    /** Return the column's name: of the chosen target, or of the picture. */
    name(measure) {
        return this.gallery.measureOf.has(measure) ? measure : `${measure}@${this.target}`;
    }

    draw() {
        const { gallery, selection } = this;
        this.about.textContent = `${selection.rows.length} of ${gallery.count} pictures`;
        const source = new Source(gallery, selection.rows);
        const [range, sun, brightness, visible] = HISTOGRAMS.map((measure) =>
            this.histogram(source, this.name(measure)),
        );
        const cards = [range, sun, this.attitudes(source), brightness, this.positions(source), visible];
        this.cards.replaceChildren(...cards.filter(Boolean));
    }

    card(title, note, ...children) {
        return element(
            "section",
            { className: "card" },
            element("h2", {}, title),
            element("p", { className: "hint" }, note),
            ...children,
        );
    }

    /** Return the card of one measure: bars for this dataset, an outline for the other one, as shares of each. */
    histogram(source, name) {
        const own = source.own(name);
        if (!own) return null;
        const other = source.beside(name) ?? [];
        const span = extent(own, other);
        const title = this.gallery.title(name);
        if (!span) return this.card(title, "No picture has it.");
        const shares = [own, other].map((numbers) => shareOf(counts(numbers, null, span, BINS)));
        const most = Math.max(...shares[0], ...shares[1], 1e-9);
        const chart = shape("svg", {
            viewBox: "0 0 400 150",
            class: "plot",
            role: "img",
            "aria-label": `Histogram of ${title}`,
        });
        chart.append(
            shape("path", {
                d: bars(
                    shares[0].map((each) => each / most),
                    400,
                    150,
                ),
                class: "own",
            }),
        );
        if (other.length)
            chart.append(
                shape("path", {
                    d: bars(
                        shares[1].map((each) => each / most),
                        400,
                        150,
                    ),
                    class: "other",
                }),
            );
        const ends = element(
            "div",
            { className: "axis-ends" },
            ...[span[0], (span[0] + span[1]) / 2, span[1]].map((end) =>
                element("span", {}, `${shown(end, 3)} ${this.gallery.unit(name)}`),
            ),
        );
        return this.card(title, summary(own, this.gallery.unit(name)), chart, ends);
    }

    /** Return the card of where targets are in the frame. */
    positions(source) {
        const [across, down] = [this.name("u"), this.name("v")];
        if (!source.own(across)) return null;
        const draw = (u, v, colour) => {
            const canvas = density(u, v, [0, 1], [0, 1], 48, 30, colour);
            canvas.setAttribute("role", "img");
            canvas.setAttribute("aria-label", "Where the middle of the box is in the frame");
            return canvas;
        };
        const parts = [draw(source.own(across), source.own(down), "--accent")];
        if (source.beside(across)) parts.push(draw(source.beside(across), source.beside(down), "--other"));
        return this.card(
            "Position in the frame",
            "The middle of the visible box; stronger is more frequent.",
            element("div", { className: "pair" }, ...parts),
        );
    }

    /** Return the card of where the camera is, seen from the target. */
    attitudes(source) {
        const names = ["from_x", "from_y", "from_z"].map((name) => this.name(name));
        if (!source.own(names[0])) return null;
        const parts = [
            hemispheres(
                names.map((name) => source.own(name)),
                "--accent",
            ),
        ];
        if (source.beside(names[0]))
            parts.push(
                hemispheres(
                    names.map((name) => source.beside(name)),
                    "--other",
                ),
            );
        const card = this.card("Attitude", "Where the camera is, in the body's axes; equal areas (Lambert).", ...parts);
        card.classList.add("tall");
        return card;
    }
}

/** Return the counts as shares of their sum. */
function shareOf(found) {
    const sum = found.reduce((a, b) => a + b, 0) || 1;
    return Array.from(found, (each) => each / sum);
}

/** Say the least, the median and the greatest number. */
function summary(numbers, unit) {
    const sorted = Float32Array.from(numbers)
        .filter((number) => !Number.isNaN(number))
        .sort();
    const at = (share) => shown(sorted[Math.round(share * (sorted.length - 1))], 4);
    return `${at(0)} to ${at(1)}${unit ? ` ${unit}` : ""}, median ${at(0.5)}`;
}
