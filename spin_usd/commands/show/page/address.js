"use strict";
// The address after "#": which view, of which picture, and after "?" what is chosen and how it is sorted.
// "#picture/nominal/img000003?sort=range@1&in:range@1=4..8&is:variant=nominal". A user may have made anything of it.

const VIEWS = ["pictures", "distributions", "picture"];

/** Return the address of a view: names are those of a picture, none for none; query is that of a selection. */
function addressOf(view, names, query) {
    const path = [view, ...names].map(encodeURIComponent).join("/");
    return query ? `${path}?${query}` : path;
}

/** Return what the window's address says: { view, names, query }. */
function addressed() {
    const [path, ...rest] = location.hash.slice(1).split("?");
    let parts = [];
    try {
        parts = path.split("/").map(decodeURIComponent);
    } catch {
        // it was cut short, or never was ours
    }
    const [view, ...names] = parts;
    return { view: VIEWS.includes(view) ? view : "pictures", names, query: rest.join("?") };
}

/** Return what the selection is as a query; "" for all pictures in the dataset's order. */
function queryOf(selection) {
    const found = new URLSearchParams();
    if (selection.text) found.set("name", selection.text);
    if (selection.damagedOnly) found.set("damaged", "yes");
    for (const name of selection.tags) found.append("tag", name);
    for (const [name, { low, high }] of selection.ranges) found.set(`in:${name}`, `${endText(low)}..${endText(high)}`);
    for (const [name, { words, chosen }] of selection.choices) {
        if (!chosen.size) found.set(`none:${name}`, "");
        for (const number of chosen) found.append(`is:${name}`, words[number]);
    }
    if (selection.sortedBy) found.set("sort", selection.sortedBy);
    if (selection.descending) found.set("down", "yes");
    return found.toString().replaceAll("%40", "@").replaceAll("%3A", ":"); // as people write them
}

/** Return a promise of what the query says of a selection; what gallery and tags do not have is passed over. */
async function readQuery(query, gallery, given) {
    const said = new URLSearchParams(query);
    const tags = new Set(said.getAll("tag").filter((name) => given.of.has(name)));
    const [ranges, choices] = [new Map(), new Map()];
    for (const [key, value] of said) {
        const [, kind, name] = /^(in|is|none):(.*)$/s.exec(key) ?? [];
        const column = gallery.has(name) && (await gallery.column(name));
        if (!column || (kind === "in") === column.words.length > 0) continue;
        if (kind === "in") {
            const [low, high] = value.split("..").map((end) => (end.trim() ? Number(end) : NaN));
            ranges.set(name, {
                numbers: column.numbers,
                low: Number.isFinite(low) ? low : -Infinity,
                high: Number.isFinite(high) ? high : Infinity,
            });
        } else {
            if (!choices.has(name)) choices.set(name, { ...column, chosen: new Set() });
            const number = column.words.indexOf(value);
            if (kind === "is" && number >= 0) choices.get(name).chosen.add(number);
        }
    }
    const sortedBy = gallery.has(said.get("sort")) ? said.get("sort") : "";
    const sorting = sortedBy ? inOrder(await gallery.column(sortedBy)) : null;
    const text = (said.get("name") ?? "").toLowerCase();
    const [damagedOnly, descending] = [said.has("damaged"), said.has("down")];
    return { tags, ranges, choices, text, damagedOnly, sortedBy, sorting, descending };
}
