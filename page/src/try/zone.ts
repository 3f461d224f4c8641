/** A keep-out zone along the row. */
export interface Zone {
    readonly startMm: number;
    readonly endMm: number;
}
