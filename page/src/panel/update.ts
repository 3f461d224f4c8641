// The update of a connected Uno whose firmware differs from the page's. Its settings go to a file, and the page flashes
// it. A button then restores the settings that the new firmware has lost.

import { ask as askRust } from "../core.ts";
import type { Parts } from "../dom.ts";
import type { Happening } from "../link/session.ts";
import { save, update } from "../link/settings_file.ts";
import { chosen, keep } from "../preferences.ts";
import { say } from "../words/words.ts";
import type { Panel } from "./panel.ts";

/** The key of the stored settings, until the new firmware has them. */
const KEPT = "settings";

export class Update {
    readonly #own = askRust<{ readonly version: string; readonly settings: readonly string[] }>("firmware");
    readonly #version = this.#own.version + COMMIT;

    /** `flash` opens the view for flashing. */
    constructor(
        private readonly parts: Parts,
        private readonly panel: Panel,
        flash: () => Promise<void>,
    ) {
        parts.button("update-go", () => {
            const { settings, help } = panel.machine;
            save(settings, help);
            keep(KEPT, JSON.stringify(settings.map(({ name, value }) => [name, value])));
            void flash();
        });
        parts.button("restore-go", () => void parts.attempt("restore-said", this.#putBack()));
        parts.button("restore-drop", () => {
            keep(KEPT, "");
            this.#show();
        });
    }

    take({ is }: Happening): void {
        if (is === "connected") {
            const kept = this.#kept();
            const lacks = this.panel.machine.settings.some(({ name, saved }) => saved !== (kept.get(name) ?? saved));
            if (this.#changes().isOwn && !lacks) keep(KEPT, "");
            this.parts.write("restore-said", "");
        }
        if (["connected", "lost", "settings", "event"].includes(is)) this.#show();
    }

    /** The settings that only the machine has, and that only this page's firmware has; whether all is the same. */
    #changes(): { gone: string[]; added: string[]; isOwn: boolean } {
        const { settings, version } = this.panel.machine;
        const names = settings.map(({ name }) => name);
        const gone = names.filter((name) => !this.#own.settings.includes(name));
        const added = this.#own.settings.filter((name) => !names.includes(name));
        return { gone, added, isOwn: version === this.#version && gone.length + added.length === 0 };
    }

    /** The stored settings, until the machine has saved them. */
    #kept(): Map<string, number> {
        const kept = new Map<string, number>(JSON.parse(chosen(KEPT) || "[]"));
        update(kept, (name) => kept.get(name) ?? 0);
        return kept;
    }

    #show(): void {
        const { version } = this.panel.machine;
        const { gone, added, isOwn } = this.#changes();
        const isOther = version !== undefined && !isOwn;
        this.parts.html("update").hidden = !isOther;
        if (isOther) {
            const said = () => [
                say("otherFirmware", { theirs: version, ours: this.#version }),
                gone.length > 0 && say("settingsGone", { names: gone.join(", ") }),
                added.length > 0 && say("settingsAdded", { names: added.join(", ") }),
                gone.length + added.length > 0 && say("settingsLost"),
                say("settingsToFile"),
            ];
            this.parts.say("update-said", () => said().filter(Boolean).join(" "));
        }
        this.parts.html("restore").hidden = version === undefined || isOther || this.#kept().size === 0;
    }

    async #putBack(): Promise<void> {
        const values = this.#kept();
        const unknown = [...values.keys()].filter((name) => !this.#own.settings.includes(name));
        for (const name of unknown) values.delete(name);
        if (!(await this.panel.putBack(values))) {
            this.parts.say("restore-said", () => say("notAllPutBack"));
            return;
        }
        keep(KEPT, "");
        const names = unknown.join(", ");
        const also = () => (names === "" ? "" : ` ${say("hasNoSuch", { names })}`);
        this.parts.say("restore-said", () => say("areBack") + also());
        this.#show();
    }
}
