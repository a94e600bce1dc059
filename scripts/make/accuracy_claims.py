"""Three sentences of what `tandem cost` found on all stored machines. Each is made of the stored figures, and refused where they
do not hold it. Imported by scripts/report and scripts/make/accuracy_picture."""
import statistics


class DoesNotHold(Exception):
    """A sentence that the stored results contradict."""


def arms_of(reports, knob, setting):
    """(baseline, arm) of each scene that has this setting."""
    return [(report["arms"][0], arm) for report in reports.values() for arm in report["arms"][1:]
            if (arm["knob"], arm["setting"]) == (knob, setting)]


def with_noise(pairs):
    """Without noise there is nothing to be sooner with."""
    return [(base, arm) for base, arm in pairs if base["efficiency"] is not None and arm["efficiency"] is not None]


def median_sooner(pairs):
    """How many times sooner than the baseline noise is as small, in the median."""
    return statistics.median(1 / arm["cost_ratio"]["value"] for _, arm in pairs)


def listed(words):
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def each_machine(results, knob, setting):
    """{machine: pairs}, without machines that did not measure it; at least one did."""
    pairs = {name: found for name, reports in results.items() if (found := arms_of(reports, knob, setting))}
    if not pairs:
        raise DoesNotHold(f"no stored result has {knob} {setting}")
    return pairs


def sobol(results):
    told = []
    for machine, pairs in each_machine(results, "generator", "sobol").items():
        pairs = with_noise(pairs)
        sooner = sum(arm["cost_ratio"]["high"] < 1 for _, arm in pairs)
        later = sum(arm["cost_ratio"]["low"] > 1 for _, arm in pairs)
        if 2 * sooner <= len(pairs) or later > 0 or median_sooner(pairs) <= 1:
            raise DoesNotHold(f"{machine}: Sobol points are sooner on {sooner} of {len(pairs)} scenes, later on {later}")
        told.append(f"{median_sooner(pairs):.1f} ({machine})")
    return f"Sobol points reach the same noise {listed(told)} times sooner, in the median of scenes."


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
    return f"Four bounces leave an error above 1 % on {listed(told)} scenes."


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
