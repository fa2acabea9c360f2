"""The quantities that a sweep can be asked for, and the codes of what each launch came to."""

# What is asked of each launch. Of batches also SPANS: the offsets of both ends from the launch, or of a lap and NaN.
HALF_PERIOD, PERIOD, TURNING_POINTS, ARRIVAL_TIME, MIN_SPEED, MAX_SPEED, MIN_FORCE, MAX_FORCE, SPANS = range(9)

# What each launch came to: answered; left to the exact problem; never repeats; not numbers; outside the domain;
# never at the place asked for. Of batches also SPANNED: its span is known.
ANSWERED, UNDECIDED, NOT_PERIODIC, NOT_FINITE, OUTSIDE_DOMAIN, NEVER_THERE = range(6)
SPAN_KNOWN = -1
