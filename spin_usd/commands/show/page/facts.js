"use strict";
// What is known of a picture in words and numbers: at a pixel, of the whole picture, and how it was made.

const LIT = { 1: "lit by the Sun", 2: "in a shadow", 3: "turned away", 4: "no Sun there" };

/** Return the rows [name, text, whether it is long] that say what the labels hold at the pixel [column, row]; texts of
 * "–" for none. */
function factsAt(labels, gallery, pixel) {
    const [column, row] = pixel ?? [];
    const found = [
        ["Pixel", pixel ? `column ${column}, row ${row}` : "–"],
        ["Its centre", pixel ? `${column + 0.5}, ${row + 0.5}` : "–"],
    ];
    for (const { kind, unit } of labels ? gallery.labels : []) {
        if (!labels.has(kind)) continue;
        const values = pixel && labels.at(kind, column, row);
        const text = values ? factText(kind, values, gallery, labels) : "–";
        found.push([overlayTitle(kind) + (unit ? `, ${unit}` : ""), text, labels.described[kind].channels > 1]);
    }
    return found;
}

function factText(kind, values, gallery, labels) {
    if (kind === "segmentation") {
        const [name, of, , materials] = gallery.parts[values[0]] ?? ["unknown", "?", 0, []];
        return [`${name} (${of})`, ...materials, `id ${values[0]}`].join(", ");
    }
    if (kind === "instance")
        return gallery.targets.find((target) => target.id === values[0])?.name ?? String(values[0]);
    if (kind === "classes") return gallery.classes[values[0] - 1] ?? String(values[0]);
    if (kind === "lit") return LIT[values[0]] ?? String(values[0]);
    const rounded = labels.described[kind].step_from_depth !== undefined;
    const texts = values.map((value) =>
        Number.isNaN(value)
            ? "–"
            : rounded
              ? value.toFixed(5)
              : Number.isInteger(value)
                ? String(value)
                : exactly(value),
    );
    return texts.join(", ");
}

/** Return a table of rows [name, text]. */
function table(rows, className = "facts") {
    const body = rows.map(([name, text]) =>
        element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, text)),
    );
    return element("table", { className }, element("tbody", {}, ...body));
}

function section(title, open, ...children) {
    return element("details", { open }, element("summary", {}, title), ...children);
}

/** Return what the measures of the row are. */
function measureTable(gallery, row) {
    return table(
        gallery.measures
            .filter(({ name }) => !name.startsWith("from_") && !Number.isNaN(gallery.numbers.get(name)[row]))
            .map(({ name }) => [gallery.title(name), gallery.value(name, row)]),
    );
}

/** Return the text as one word of a shell's command. */
function quoted(text) {
    return /^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;
}

/** Return the command that makes the picture again and compares it. */
function reproduceCommand(gallery, row) {
    const variant = gallery.variant(row);
    const words = [
        "spin-usd",
        "reproduce",
        gallery.given,
        gallery.frame(row),
        ...(variant === "nominal" ? [] : ["--variant", variant]),
    ];
    return words.map(quoted).join(" ");
}

function copyable(text) {
    const button = element("button", { type: "button", className: "copy" }, "Copy");
    const code = element("code", { tabIndex: 0 }, text);
    button.addEventListener("click", async () => {
        try {
            await navigator.clipboard.writeText(text);
            button.textContent = "Copied";
        } catch {
            getSelection().selectAllChildren(code);
            button.textContent = "Press Ctrl-C";
        }
        setTimeout(() => {
            button.textContent = "Copy";
        }, 2000);
    });
    return element("div", { className: "command" }, code, button);
}

/** Return the sections on how the picture was made. */
function provenance(record) {
    const { stage = {}, render = {}, versions = {}, seed = {}, time_code: time } = record.provenance ?? {};
    const layers = Object.entries(stage.files ?? {}).map(([name, digest]) => [name, String(digest).slice(0, 12)]);
    const chosen = Object.entries(stage.variants ?? {});
    const how = [
        ["Root layer", stage.root],
        ["Time code", time],
        ["Renderer", render.renderer],
        ["Device", render.device],
        ...Object.entries(render.effort ?? {}),
        ...Object.entries(seed).map(([name, each]) => [`seed, ${name}`, each]),
        ...Object.entries(versions),
    ]
        .filter(([, value]) => value !== undefined)
        .map(([name, value]) => [name, String(value)]);
    return [
        ...(layers.length ? [section(`Layers (${layers.length})`, false, table(layers, "facts layers"))] : []),
        ...(chosen.length
            ? [section("Variants selected", false, table(chosen.map(([set, name]) => [set, String(name)])))]
            : []),
        ...(how.length ? [section("Made with", false, table(how))] : []),
    ];
}

/** Return a JSON value as a tree that opens level by level; the inside of a level is made when it is opened. */
function tree(name, value) {
    if (typeof value !== "object" || value === null)
        return element("div", { className: "leaf" }, element("span", {}, `${name}: `), JSON.stringify(value));
    const entries = Object.entries(value);
    if (Array.isArray(value) && entries.every(([, each]) => typeof each !== "object" || each === null))
        return element(
            "div",
            { className: "leaf" },
            element("span", {}, `${name}: `),
            JSON.stringify(value).replaceAll(",", ", "),
        );
    const node = element("details", {}, element("summary", {}, `${name} (${entries.length})`));
    node.addEventListener("toggle", () => node.append(...entries.map(([key, each]) => tree(key, each))), {
        once: true,
    });
    return node;
}
