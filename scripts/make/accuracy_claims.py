"""Three sentences of what `tandem cost` found on all stored machines. Each is made of the stored figures, and refused where they
do not hold it. Imported by scripts/report and scripts/make/accuracy_picture."""
import statistics

import frontier


class DoesNotHold(Exception):
    """A sentence that the stored results contradict."""


def arms_of(reports, knob, setting):
    """(baseline, arm) of each scene that has this setting."""
    return [(report["arms"][0], arm) for report in reports.values() for arm in report["arms"][1:]
            if (arm["knob"], arm["setting"]) == (knob, setting)]


def with_noise(pairs):
    """Without noise there is nothing to be sooner with, and without renders side by side nothing to compare."""
    return [(base, arm) for base, arm in pairs
            if base["efficiency"] is not None and arm["efficiency"] is not None and frontier.has_time_ratio(arm)]


def both_measured(pairs, error):
    """(the baseline's time, the arm's) to an error, where both were measured to it."""
    times = [(frontier.measured(base, error), frontier.measured(arm, error)) for base, arm in pairs]
    return [(base, arm) for base, arm in times if base and arm]


def listed(words):
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def each_machine(results, knob, setting):
    """{machine: pairs}, without machines that did not measure it; at least one did."""
    pairs = {name: found for name, reports in results.items() if (found := arms_of(reports, knob, setting))}
    if not pairs:
        raise DoesNotHold(f"no stored result has {knob} {setting}")
    return pairs


def sobol(results):
    """By times to one error: how much they gain grows with the number of samples."""
    told = []
    for machine, pairs in each_machine(results, "generator", "sobol").items():
        times = both_measured(with_noise(pairs), 0.05)
        if not times:
            continue
        sooner = sum(arm["seconds_high"] < base["seconds_low"] for base, arm in times)
        later = sum(arm["seconds_low"] > base["seconds_high"] for base, arm in times)
        gain = statistics.median(base["seconds"] / arm["seconds"] for base, arm in times)
        if 2 * sooner <= len(times) or later > 0 or gain <= 1:
            raise DoesNotHold(f"{machine}: Sobol points are sooner on {sooner} of {len(times)} scenes, later on {later}")
        told.append(f"{gain:.1f} ({machine}, {len(times)}{'' if told else ' scenes'})")
    if not told:
        raise DoesNotHold("no baseline and Sobol points were both measured to 5 %")
    return f"Sobol points are {listed(told)} times sooner at an error of 5 %, in the median."


def light_sampling(results):
    """Over scenes whose own settings sample the lights, and over those whose own do not."""
    told = []
    for machine, reports in results.items():
        own, without = (with_noise(arms_of(reports, "integrator", setting)) for setting in ("path", "next-event"))
        if not own and not without:
            continue
        worth = sum(arm["cost_ratio"]["low"] > 1 for _, arm in own) + sum(arm["cost_ratio"]["high"] < 1 for _, arm in without)
        count = len(own) + len(without)
        if 2 * worth <= count:
            raise DoesNotHold(f"{machine}: sampling the lights is worth it on {worth} of {count} scenes")
        told.append(f"{worth} of {count} ({machine})")
    if not told:
        raise DoesNotHold("no stored result has integrator path or next-event")
    return f"Sampling the lights reaches the same noise sooner than scattering alone on {listed(told)} scenes."


def few_bounces(results):
    told = []
    for machine, pairs in each_machine(results, "bounces", "4").items():
        biased = sum(arm["bias_floor_significant"] and arm["bias_floor_low"] > 0.01 for _, arm in pairs)
        if biased == 0:
            raise DoesNotHold(f"{machine}: four bounces leave no error above 1 %")
        told.append(f"{biased} of {len(pairs)} ({machine})")
    return f"Four bounces leave an error above 1 % on at least {listed(told)} scenes."


CLAIMS = [sobol, light_sampling, few_bounces]


def sentences(results):
    """Those that hold, in order; whoever needs all three calls CLAIMS."""
    told = []
    for claim in CLAIMS:
        try:
            told.append(claim(results))
        except DoesNotHold:
            pass
    return told
