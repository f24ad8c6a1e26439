#!/bin/sh
# Runs the cases with their own settings and draws cases/NAME/figure.png; needs ordo (ORDO, by default the release build), matplotlib
# and vtk.
# Usage: scripts/case_figures.sh [NAME...]
set -eu
cd "$(dirname "$0")/.."
python=${PYTHON:-/usr/bin/python3}
ordo=${ORDO:-build/release/ordo}

preset=   # where set, the method of the run, and figure-PRESET.png is drawn
variant=  # where set, case-VARIANT.toml is run, and figure-VARIANT.png is drawn
draw() {  # NAME, then options of `ordo_figures.py snapshots`
    name=$1
    shift
    suffix=${preset:+-$preset}${variant:+-$variant}
    out=build/cases/$name$suffix
    "$ordo" run "cases/$name/case${variant:+-$variant}.toml" ${preset:+--set "method.preset=$preset"} --output "$out" --overwrite --quiet
    "$python" python/ordo_figures.py snapshots "$out" -o "cases/$name/figure$suffix.png" "$@"
}

[ $# -gt 0 ] || set -- two-disks wall-rebound two-balls ball-on-wall cantilever vibrating-bar pressure-ring \
    bimaterial-bar bimaterial-ring bimaterial-sphere touching-bodies oedometer incline strip-footing vertical-cut granular-column taylor-bar \
    cook-membrane water-column dam-break two-disks-contact block-on-incline shaken-table spinning-rings hertz-contact two-spheres-contact \
    block-on-plate press-fit rolling-cylinder ball-through-slab gears wheel-on-sand static everyday
for case in "$@"; do
    case $case in
    everyday) "$python" scripts/everyday.py "$ordo" --methods 'cpdi1,cpls,cpls-limited,fmpm' --results build/cases/everyday --figure cases/everyday/figure.png ;;
    touching-bodies) draw "$case" --times 0.0,0.1,0.2 --field velocity ;;
    oedometer) draw "$case" --times 0.0,1.0,2.0 --field stress_yy --curve history.csv:press_force_y ;;
    vertical-cut) draw "$case" --times 15,20,30 --field plastic_strain --limits 0,0.5 --curve energies ;;
    granular-column) draw "$case" --times 0.1,0.3,0.6 --field velocity --curve energies ;;
    strip-footing) draw "$case" --times 30,60 --field pressure --limits=-0.002,0.012 --curve history.csv:footing_force_y ;;
    incline) draw "$case" --times 0.0,0.5,1.0 --field velocity --curve energies ;;
    taylor-bar)
        draw "$case" --times 1e-5,3e-5,8e-5 --field plastic_strain --limits 0,1.5 --curve energies
        (variant=obstacle; draw "$case" --times 4e-5,6e-5,8e-5 --field plastic_strain --limits 0,1.5 --curve history.csv:wall_force_y)
        (variant=3d; draw "$case" --times 1.2e-5,4e-5,8e-5 --field plastic_strain --limits 0,2.5 --view=-60,15 --curve energies)
        ;;
    cook-membrane) draw "$case" --times 0,1.1e-3,3.3e-3 --field pressure --limits=-15e6,25e6 --curve probe_tip.csv:displacement_x,displacement_y ;;
    water-column) draw "$case" --times 0,0.5,1.2 --field pressure --limits 0,1e4 --curve history.csv:floor_force_y ;;
    dam-break) draw "$case" --times 0.05,0.1,0.2 --field velocity --curve energies ;;
    two-disks) draw "$case" --times 1.0,2.0,3.0 --field velocity --curve energies ;;
    wall-rebound) draw "$case" --times 1.0,3.0,5.0 --field velocity --curve energies --walls 0.05,0.75 ;;
    two-balls) draw "$case" --times 1.0,2.0,3.0 --field velocity --view=-45,10 --curve energies ;;
    ball-on-wall) draw "$case" --times 0.0,0.75,1.2 --field von_mises --view=-70,15 --curve energies ;;
    cantilever) draw "$case" --times 0.0,0.2,0.45 --field von_mises --curve probe_tip.csv:displacement_y ;;
    vibrating-bar) draw "$case" --times 0.002,0.004,0.011,0.013 --field displacement --curve energies ;;
    pressure-ring) draw "$case" --times 1.0,2.0,4.5 --field von_mises --curve probe_rim.csv:displacement_x ;;
    two-disks-contact) draw "$case" --times 0.5,1.5,3.0 --field velocity --curve energies ;;
    block-on-incline) draw "$case" --times 0.4,0.8,1.7 --field velocity --curve energies ;;
    shaken-table) draw "$case" --times 0.5,1.2,2.2 --field velocity --curve history.csv:contact_0_force_x ;;
    spinning-rings) draw "$case" --times 0.1,0.4,0.9 --field velocity --curve history.csv:contact_0_moment_z ;;
    hertz-contact) draw "$case" --times 4,8,28 --field stress_yy --limits=-100,0 --curve history.csv:contact_0_force_y ;;
    two-spheres-contact) draw "$case" --times 0.5,1.3,2.4 --field velocity --curve energies ;;
    press-fit) draw "$case" --times 0.5,2,6 --field stress_xx --curve energies ;;
    rolling-cylinder)
        set -- "$case" --times 0.6,1.0,1.4 --field von_mises --limits 0,5e4 --curve history.csv:plane_force_x
        draw "$@"
        (variant=sphere; draw "$@" --view=-60,20)
        ;;
    ball-through-slab) draw "$case" --times 0.02,0.04,0.06 --field plastic_strain --limits 0,2 --curve history.csv:ball_velocity_y ;;
    gears) draw "$case" --times 0.5,1.2,4 --field von_mises --limits 0,2e5 --curve history.csv:driven_shaft_rotation_z ;;
    wheel-on-sand) draw "$case" --times 0.5,2,3.5 --field plastic_strain --limits 0,0.5 --curve history.csv:wheel_force_x ;;
    static) draw "$case" --times 0.2,0.6,1 --field stress_xx --curve probe_tip.csv:displacement_y ;;
    block-on-plate) draw "$case" --times 0.4,0.8,1.2 --field velocity --view=-60,20 --curve energies ;;
    bimaterial-bar)
        set -- "$case" --times 0.08,0.16,0.34,0.53 --field stress_yy --limits=-20000,160000 --curve probe_B.csv:stress_yy
        draw "$@"
        (preset=cpdi2; draw "$@")
        ;;
    bimaterial-ring) draw "$case" --times 0.003,0.006,0.0105 --field von_mises --curve probe_A.csv:displacement_x ;;
    bimaterial-sphere)
        set -- "$case" --times 0.1,0.15,0.2 --field von_mises --limits 0,150000 --view=-125,-25
        draw "$@"
        (preset=cpdi2; draw "$@")
        ;;
    *) echo "case_figures.sh: no figure is set up for $case" >&2; exit 2 ;;
    esac
done
