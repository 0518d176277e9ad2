"use strict";
// The grid: only the tiles that can be seen are there, however many pictures there are.

const GAP = 10,
    CAPTION = 40; // pixels
const OVERSCAN = 1; // rows of tiles above and below those that are seen
const ASPECT = 0.625; // of a thumbnail, height to width

class Grid extends EventTarget {
    constructor(gallery, selection, tags, node, tiles, empty) {
        super();
        Object.assign(this, { tags, pen: null }); // pen: the tag that a click gives or takes, null for none
        tags.addEventListener("change", () => {
            for (const [place, tile] of this.shown) this.fillBadges(tile, this.selection.rows[place]);
        });
        Object.assign(this, { gallery, selection, node, tiles, empty, least: 200, ofTarget: false, current: 0 });
        this.shown = new Map(); // tiles by their places
        node.addEventListener("scroll", () => this.draw(), { passive: true });
        new ResizeObserver(() => this.draw()).observe(node);
        selection.addEventListener("change", () => {
            node.scrollTop = 0;
            this.restart();
        });
        tiles.addEventListener("click", (event) => this.clicked(event));
        tiles.addEventListener("error", (event) => event.target.closest(".tile")?.classList.add("damaged"), true);
        this.draw();
    }

    get columns() {
        return Math.max(Math.floor((this.node.clientWidth - GAP) / (this.least + GAP)), 1);
    }

    /** The width of a tile: as many of at least the width asked for fill the window. */
    get width() {
        return Math.floor((this.node.clientWidth - GAP) / this.columns) - GAP;
    }

    get pitch() {
        return Math.round(this.width * ASPECT) + CAPTION + GAP;
    }

    /** Make tiles at least so wide. */
    setWidth(least) {
        this.least = least;
        this.restart();
    }

    /** Show the targets alone, or whole frames. */
    setCrop(ofTarget) {
        this.ofTarget = ofTarget;
        this.restart();
    }

    restart() {
        for (const tile of this.shown.values()) tile.remove();
        this.shown.clear();
        this.current = Math.min(this.current, Math.max(this.selection.rows.length - 1, 0));
        this.draw();
    }

    /** Show the tiles that lie in the window, and remove all others. */
    draw() {
        if (!this.node.clientHeight) return;
        const { columns, pitch } = this;
        const total = this.selection.rows.length;
        this.empty.hidden = total > 0;
        this.tiles.style.height = `${Math.ceil(total / columns) * pitch + GAP}px`;
        const first = Math.max(Math.floor(this.node.scrollTop / pitch) - OVERSCAN, 0) * columns;
        const last = Math.min(
            (Math.ceil((this.node.scrollTop + this.node.clientHeight) / pitch) + OVERSCAN) * columns,
            total,
        );
        for (const [place, tile] of this.shown) {
            if (place < first || place >= last) {
                tile.remove();
                this.shown.delete(place);
            }
        }
        for (let place = first; place < last; place += 1) this.place(place, columns, pitch);
    }

    place(place, columns, pitch) {
        let tile = this.shown.get(place);
        if (!tile) {
            tile = this.tile(this.selection.rows[place], place);
            this.shown.set(place, tile);
            this.tiles.append(tile);
        }
        tile.style.width = `${this.width}px`;
        tile.firstChild.style.height = `${Math.round(this.width * ASPECT)}px`;
        const x = GAP + (place % columns) * (this.width + GAP);
        const y = GAP + Math.floor(place / columns) * pitch;
        tile.style.transform = `translate(${x}px, ${y}px)`;
        tile.tabIndex = place === this.current ? 0 : -1;
    }

    tile(row, place) {
        const { gallery } = this;
        const fault = gallery.faults.get(row);
        const name = gallery.thumbnail(row, this.ofTarget);
        const picture = name
            ? element("img", { alt: "", decoding: "async", src: name })
            : element("span", { className: "nothing" }, "no image");
        const frame = element("span", { className: "frame" }, picture, element("span", { className: "badges" }));
        const about = element(
            "span",
            { className: "about" },
            [gallery.variant(row), gallery.value("range@1", row)].join(" · "),
        );
        const found = element(
            "button",
            { type: "button", className: "tile", "aria-label": `${gallery.frame(row)}, ${about.textContent}` },
            frame,
            element("span", { className: "name" }, gallery.frame(row)),
            about,
        );
        if (fault) {
            found.classList.add("damaged");
            found.title = fault;
        }
        found.dataset.place = place;
        this.fillBadges(found, row);
        return found;
    }

    fillBadges(tile, row) {
        const names = this.tags.tagsOf(row).map((name) => element("span", {}, name));
        tile.querySelector(".badges").replaceChildren(...names);
    }

    /** Let clicks give or take that tag; null: open pictures. */
    setPen(name) {
        this.pen = name;
        this.node.classList.toggle("marking", name !== null);
        this.dispatchEvent(new Event("change"));
    }

    /** The row of the tile that has the focus; undefined where there is none. */
    get row() {
        return this.selection.rows[this.current];
    }

    clicked(event) {
        const tile = event.target.closest(".tile");
        if (!tile) return;
        this.current = Number(tile.dataset.place);
        if (this.pen !== null) return this.tags.toggle(this.pen, this.row);
        this.dispatchEvent(new CustomEvent("open", { detail: this.row }));
    }

    /** Move the focus by so many tiles, or to a place, and scroll there. */
    focus(place) {
        const last = this.selection.rows.length - 1;
        if (last < 0) return;
        this.current = Math.min(Math.max(place, 0), last);
        const top = Math.floor(this.current / this.columns) * this.pitch;
        if (top < this.node.scrollTop) this.node.scrollTop = top;
        if (top + this.pitch + GAP > this.node.scrollTop + this.node.clientHeight)
            this.node.scrollTop = top + this.pitch + GAP - this.node.clientHeight;
        this.draw();
        this.shown.get(this.current)?.focus({ preventScroll: true });
        this.dispatchEvent(new Event("move"));
    }

    /** Answer a key: arrows, Page Up and Down, Home, End. Return whether it was one of these. */
    key(key) {
        const page = this.columns * Math.max(Math.floor(this.node.clientHeight / this.pitch), 1);
        const step = {
            ArrowLeft: -1,
            ArrowRight: 1,
            ArrowUp: -this.columns,
            ArrowDown: this.columns,
            PageUp: -page,
            PageDown: page,
            Home: -Infinity,
            End: Infinity,
        }[key];
        if (step === undefined) return false;
        this.focus(this.current + step);
        return true;
    }
}
