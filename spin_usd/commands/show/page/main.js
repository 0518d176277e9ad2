"use strict";
// Starts the page: the part of the address after "#" says what it shows.

class Page {
    constructor(gallery) {
        this.gallery = gallery;
        this.selection = new Selection(gallery);
        this.grid = new Grid(gallery, this.selection, byId("grid"), byId("tiles"), byId("empty"));
        this.filters = new Filters(gallery, this.selection, byId("filters"));
        this.picture = new PictureView(gallery, this.selection, byId("stage"), byId("side"));
        this.filters.addEventListener("fault", ({ detail }) => this.say(detail));
        this.distributions = new Distributions(gallery, this.selection, byId("distributions"));
        byId("dataset").textContent = document.title = gallery.dataset;
        fillKeys(byId("keys"), this.picture.overlays);
        this.fillSorting();
        this.listen();
        this.count();
        this.route();
        document.body.dataset.ready = "";
    }

    fillSorting() {
        const option = (value, text) => element("option", { value }, text);
        const measures = this.gallery.measures.map(({ name }) => option(name, this.gallery.title(name)));
        const others = [...this.gallery.files.keys()].map((name) => option(name, name));
        byId("sort").append(
            option("", "as in the dataset"),
            element("optgroup", { label: "Measures" }, ...measures),
            element("optgroup", { label: "Values of the records" }, ...others),
        );
        byId("sort").addEventListener("change", async (event) => {
            const name = event.target.value;
            const column = name ? await this.gallery.column(name).catch((fault) => this.say(fault)) : null;
            if (column === undefined || event.target.value !== name) return; // it failed, or another was chosen
            this.say(null);
            this.selection.sorting = column && inOrder(column);
            this.selection.update();
        });
        byId("direction").addEventListener("click", (event) => {
            this.selection.descending = !this.selection.descending;
            event.target.textContent = this.selection.descending ? "↓" : "↑";
            event.target.setAttribute("aria-pressed", this.selection.descending);
            this.selection.update();
        });
        byId("size").addEventListener("input", (event) => this.grid.setWidth(Number(event.target.value)));
    }

    listen() {
        this.selection.addEventListener("change", () => this.count());
        this.grid.addEventListener("open", ({ detail }) => this.go(detail));
        this.picture.addEventListener("go", ({ detail }) => this.go(detail));
        this.picture.addEventListener("close", () => this.close());
        byId("theme").addEventListener("click", () => this.switchTheme());
        byId("help").addEventListener("click", () => byId("keys").showModal());
        addEventListener("hashchange", () => this.route());
        addEventListener("keydown", (event) => this.key(event));
    }

    /** Say what went wrong, beside the number of pictures; null takes it away. */
    say(fault) {
        byId("trouble").textContent = fault ? `${fault.message}. Run spin-usd show again.` : "";
    }

    count() {
        const { count } = this.gallery;
        const shownCount = this.selection.rows.length;
        byId("count").textContent = shownCount === count ? `${count} pictures` : `${shownCount} of ${count} pictures`;
    }

    /** Show the picture of that row. */
    go(row) {
        const names = [this.gallery.variant(row), this.gallery.frame(row)].map(encodeURIComponent);
        location.hash = ["picture", ...names].join("/");
    }

    close() {
        location.hash = "";
    }

    route() {
        const [view, variant, frame] = addressed();
        const row = view === "picture" ? this.gallery.rowOf(frame, variant) : undefined;
        const shown = row !== undefined ? "picture" : view === "distributions" ? "distributions" : "pictures";
        for (const id of ["pictures", "distributions", "picture"]) byId(id).hidden = id !== shown;
        byId("sorting").hidden = shown !== "pictures";
        byId("to-pictures").setAttribute("aria-current", shown === "distributions" ? "false" : "page");
        byId("to-distributions").setAttribute("aria-current", shown === "distributions" ? "page" : "false");
        this.view = shown;
        if (shown === "picture") this.openPicture(row);
        else this.picture.clear();
        if (shown === "distributions") this.distributions.draw();
        if (shown === "pictures") this.showGrid();
    }

    openPicture(row) {
        this.picture.open(row);
        if (!byId("picture").contains(document.activeElement)) byId("stage").focus();
    }

    showGrid() {
        const place = this.selection.rows.indexOf(this.picture.row);
        this.grid.draw();
        if (place >= 0) this.grid.focus(place);
    }

    switchTheme() {
        const dark = getComputedStyle(document.documentElement).colorScheme === "dark";
        document.documentElement.dataset.theme = dark ? "light" : "dark";
        if (this.view === "distributions") this.distributions.draw();
    }

    key(event) {
        if (event.ctrlKey || event.metaKey || event.altKey || byId("keys").open) return;
        if (event.key === "Escape" && this.view !== "pictures") this.close();
        else if (isTyping(event) || !this.act(event)) return;
        event.preventDefault();
    }

    /** Do what the key says; return whether it says anything. */
    act({ key, target }) {
        const acts = {
            "?": () => byId("help").click(),
            x: () => this.switchTheme(),
            s: () => {
                location.hash = "distributions";
            },
            g: () => this.close(),
        };
        if (acts[key]) acts[key]();
        else if (this.view === "picture") return this.actOnPicture(key);
        else if (this.view === "pictures") return this.actOnGrid(key, target);
        else return false;
        return true;
    }

    actOnGrid(key, target) {
        if (key === "/") this.filters.name.focus();
        else if (byId("filters").contains(target)) return false;
        else return this.grid.key(key);
        return true;
    }

    actOnPicture(key) {
        const { picture } = this;
        const acts = {
            ArrowLeft: () => picture.step(-1),
            ArrowRight: () => picture.step(1),
            ArrowUp: () => picture.stepVariant(-1),
            ArrowDown: () => picture.stepVariant(1),
            "+": () => picture.stage.zoomBy(1.5),
            "-": () => picture.stage.zoomBy(1 / 1.5),
            f: () => picture.stage.fit(),
            z: () => picture.zoomToTargets(),
            0: () => picture.overlays.clear(),
            i: () => picture.stage.image.classList.toggle("hidden"),
        };
        if (!acts[key]) return picture.overlays.key(key);
        acts[key]();
        return true;
    }
}

/** Return the parts of the address after "#", of which a user may have made anything. */
function addressed() {
    try {
        return location.hash.slice(1).split("/").map(decodeURIComponent);
    } catch {
        return [];
    }
}

loadData("index.js").then(
    (found) => new Page(new Gallery(found)),
    (fault) => {
        byId("dataset").textContent = `This page cannot be shown: ${fault.message}. Run spin-usd show again.`;
    },
);
