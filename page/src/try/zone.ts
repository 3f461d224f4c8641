/** Ground along the row that the firmware keeps free. */
export interface Zone {
    readonly startMm: number;
    readonly endMm: number;
}
