"use strict";
// The rows that pass all filters, in the order asked for.

class Selection extends EventTarget {
    constructor(gallery, given) {
        super();
        Object.assign(this, { gallery, given }); // given: Tags
        this.tags = new Set(); // of which a picture has one; none for all pictures
        this.ranges = new Map(); // by column: { numbers, low, high }
        this.choices = new Map(); // by column: { numbers, words, chosen: Set of numbers }
        this.text = "";
        this.damagedOnly = false;
        this.sortedBy = ""; // the column's name
        this.sorting = null; // numbers, or null for the order of the dataset
        this.descending = false;
        this.rows = Uint32Array.from({ length: gallery.count }, (_, row) => row);
    }

    setRange(name, numbers, low, high) {
        if (low === null && high === null) this.ranges.delete(name);
        else this.ranges.set(name, { numbers, low: low ?? -Infinity, high: high ?? Infinity });
        this.update();
    }

    /** column: { numbers, words } · chosen: numbers, null for all */
    setChoice(name, column, chosen) {
        if (chosen === null) this.choices.delete(name);
        else this.choices.set(name, { ...column, chosen });
        this.update();
    }

    /** Be what the address says. */
    take(state) {
        Object.assign(this, state);
        this.update();
    }

    setTag(name, on) {
        this.tags[on ? "add" : "delete"](name);
        this.update();
    }

    clear() {
        this.tags.clear();
        this.ranges.clear();
        this.choices.clear();
        this.text = "";
        this.damagedOnly = false;
        this.update();
    }

    update() {
        const found = [];
        this.tagged = this.tags.size ? this.given.rows(this.tags) : null;
        for (let row = 0; row < this.gallery.count; row += 1) if (this.passes(row)) found.push(row);
        this.rows = Uint32Array.from(found);
        if (this.sorting) this.sort();
        else if (this.descending) this.rows.reverse();
        this.dispatchEvent(new Event("change"));
    }

    passes(row) {
        if (this.text && !this.gallery.frame(row).toLowerCase().includes(this.text)) return false;
        if (this.tagged && !this.tagged.has(row)) return false;
        if (this.damagedOnly && !this.gallery.faults.has(row)) return false;
        for (const { numbers, low, high } of this.ranges.values()) {
            if (!(numbers[row] >= low && numbers[row] <= high)) return false;
        }
        for (const { numbers, chosen } of this.choices.values()) if (!chosen.has(numbers[row])) return false;
        return true;
    }

    /** Sort the rows by their numbers; those without one come last either way, equal ones in the dataset's order. */
    sort() {
        const sign = this.descending ? -1 : 1;
        const numbers = this.sorting;
        this.rows.sort((a, b) => {
            const difference = sign * (numbers[a] - numbers[b]);
            if (!Number.isNaN(difference)) return difference || a - b;
            return Number.isNaN(numbers[a]) - Number.isNaN(numbers[b]) || a - b;
        });
    }
}
