#!/usr/bin/env bash
# Computes a study with Slurm in N shards. Each shard is a task of a job array. A second job waits for them and joins
# the parts.
#
#     host/study/slurm/array.sh N FOLDER [option of sbatch ...] -- trial --replications 20
#
# The command after -- is `weeder trial`, `weeder sweep` or `weeder soak`, without --shard and --out. Its tasks run in
# the folder in which the script is called, so relative names of files are valid. All nodes must see that folder, and
# FOLDER, which is made. FOLDER gets parts/I.part, and logs/I.txt with the output of task I. At the end it gets
# result.txt, with the output of the undivided command. A trial also writes report/, and a sweep points.csv. The script
# prints the numbers of both jobs.
#
# A task is started again up to three times if its program is killed or its node fails. A task that exits with an error
# (status 2) fails, and so does the merging job. If $WEEDER is set, tasks run that program instead of `weeder`.
set -euo pipefail

usage() {
    echo "array.sh: say N FOLDER [option of sbatch ...] -- trial|sweep|soak [option ...]" >&2
    exit 2
}
[ $# -ge 4 ] || usage
shards=$1 folder=$2
shift 2
[[ $shards =~ ^[1-9][0-9]*$ ]] || usage
options=()
while [ "${1-}" != -- ]; do
    [ $# -gt 0 ] || usage
    options+=("$1")
    shift
done
shift
case "${1-}" in
    trial) out=(--out report) ;;
    sweep) out=(--out points.csv) ;;
    soak) out=() ;;
    *) usage ;;
esac
weeder=$(command -v "${WEEDER-weeder}") || {
    echo "array.sh: ${WEEDER-weeder} is not there: install it, or name the program in WEEDER." >&2
    exit 2
}
weeder=$(realpath "$weeder")
mkdir -p "$folder/parts" "$folder/logs"
folder=$(realpath "$folder")

# What is to be typed, with its quotes. The task's number is known to the task alone.
quoted() { printf '%q ' "$@"; }
study=$(quoted "$weeder" "$@")
there=$(printf %q "$folder")
# sbatch replaces symbols that begin with %.
logs=${folder//%/%%}/logs
task="#!/usr/bin/env bash
export RAYON_NUM_THREADS=\${SLURM_CPUS_PER_TASK-1}
$study --shard \$SLURM_ARRAY_TASK_ID/$shards --out $there/parts/\$SLURM_ARRAY_TASK_ID.part && exit
status=\$?
# Above 128 it did not end by itself.
if [ \$status -gt 128 ] && [ \${SLURM_RESTART_COUNT-0} -lt 3 ]; then
    scontrol requeue \${SLURM_ARRAY_JOB_ID}_\$SLURM_ARRAY_TASK_ID
    # Until Slurm ends it.
    sleep 600
fi
exit \$status"
parts=$(seq --format='parts/%.0f.part' 1 "$shards" | tr '\n' ' ')
merge="#!/usr/bin/env bash
cd $there || exit
# Status 1 is a finding, such as a plant that was damaged; it is this job's too.
$(quoted "$weeder" merge ${out[@]+"${out[@]}"})$parts >result.txt.new
status=\$?
[ \$status -gt 1 ] || mv result.txt.new result.txt
exit \$status"

# Bash before 4.4 takes an empty array for an unset one.
array=$(sbatch --parsable --job-name="weeder $1" --array="1-$shards" --requeue --open-mode=append \
    --output="$logs/%a.txt" ${options[@]+"${options[@]}"} <<<"$task")
echo "The shards: job $array"
merging=$(sbatch --parsable --job-name="weeder merge" --dependency="afterok:$array" --kill-on-invalid-dep=yes \
    --output="$logs/merge.txt" ${options[@]+"${options[@]}"} <<<"$merge")
echo "The merge: job $merging"
