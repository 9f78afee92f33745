"""Every claim of the five papers (algorithms.md, B), and what the figures found of each: the table at the top of the page."""
import dataclasses

PAPERS = {"B1": "Nichols and Wyman 2010: multiresolution splatting",
          "B2": "Nichols, Shopf and Wyman 2009: hierarchical image-space radiosity",
          "B3": "Novák, Engelhardt and Dachsbacher 2011: bias compensation in the picture",
          "B4": "Maletz, Wang and Bowers 2011: points drawn by importance",
          "B5": "Yao, Wang, Chan, Yong and Paul 2010: photons through environment maps"}

NOT_MEASURED = "not measured"


@dataclasses.dataclass(frozen=True)
class Claim:
    id: str
    says: str         # what the paper says
    figure: str = ""  # whose targets of this id tell; "" where nothing here can
    test: str = ""    # what the build's tests hold of it
    why_not: str = ""  # where there is no figure


CLAIMS = (
    Claim("B1.1", "A VPL's list at 256x256 has 5 % of the pixels.", "per_vpl"),
    Claim("B1.2", "To test and light a subsplat takes about twice as long as to light a fragment.", "per_vpl"),
    Claim("B1.3", "Refining a list for each VPL is most of the frame; one list for all is not.", "per_vpl"),
    Claim("B1.4", "64 times the pixels of indirect light take 2.1 to 3.1 times as long.", "resolution"),
    Claim("B1.5", "A threshold of normals of 1.4 is four times as fast as .25.", "thresholds"),
    Claim("B1.6", "To ask adjacent blocks too costs up to 40 %, diagonal ones 2 to 3 %.", "neighbourhood"),
    Claim("B1.7", "Along a camera's path the number of subsplats varies by up to 300 %.", "fly_through"),
    Claim("B1.8", "The number of triangles, 6 to 417 thousand, does not matter.", "resolution"),
    Claim("B1.9", "Derivatives of depth are slightly slower than its range at equal quality, and so is curvature.", "fly_through"),
    Claim("B1.10", "16x16 to 32x32 VPLs are enough for smooth animations of simple scenes.", "films"),
    Claim("B2.1", "Gathering at fragments is 18 to 20 times as fast as splatting.", "gather_or_splat"),
    Claim("B2.2", "With the list of fragments it is 14.7 to 18 times.", "gather_or_splat"),
    Claim("B2.3", "Whole frames are 5.4 to 10.1 times as fast.", "gather_or_splat"),
    Claim("B2.4", "Some 50,000 fragments, 4.8 % of the pixels, are enough at 2 to 3 % RMS.", "gather_or_splat"),
    Claim("B2.5", "Blocks of pixels alone are 2 to 3 % RMS off every pixel, and not off at thresholds of 0.", "eye_error"),
    Claim("B2.6", "Clusters of lights are 3 to 4 % off a million VPLs.", "tree"),
    Claim("B2.7", "Both are 5 to 6 % off a million VPLs at every pixel, which take half an hour.", "combined"),
    Claim("B2.8", "A million VPLs at blocks take up to 180 times less than at every pixel: 21 by the number of fragments.", "eye_error"),
    Claim("B2.9", "To find and list fragments takes the same whatever the thresholds: 17 % of the frame.", "gather_or_splat"),
    Claim("B2.10", "Light of clusters is as steady as that of more than 4,096 regular VPLs.", "films"),
    Claim("B2.11", "Frames end at some 50 a second, where other passes than the gather are all.", "tree"),
    Claim("B3.1", "An iteration takes 27 ms of a frame of 100 to 139.", "compensation"),
    Claim("B3.2", "Up to 4,000 parts of the picture for a pixel with one level; more levels soon need fewer.", "compensation"),
    Claim("B3.3", "Up to three iterations give back most of what a clamp takes off.", "compensation"),
    Claim("B3.4", "One iteration is enough for diffuse surfaces.", "compensation",
          test="ssbc: an edge that is whole in the picture gets back by it what a clamp takes off, and with rays all of it comes back once."),
    Claim("B3.5", "Parts of .08 sr, of .04 at edges, are fine enough.", "compensation"),
    Claim("B4.1", ".2 to .27 thousand millions of points a second.", "points"),
    Claim("B4.2", "3,072 of 262,144 points, drawn by importance, look like all of them.", "points"),
    Claim("B4.3", "Clusters take under 10 ms of 3 to 4 s.", "points"),
    Claim("B4.4", "A quarter to a third of the pixels is enough.", "points"),
    Claim("B4.5", "Twice as many pixels along each side, for edges, take 2 to 3 times as long.", "points"),
    Claim("B4.6", "A million points are no better than 262,144.", "points"),
    Claim("B5.1", "2.4 to 10 million photons a second, from end to end.", "photons"),
    Claim("B5.2", "Four times the pixels take 1.06 to 2.42 times as long.", "photons"),
    Claim("B5.3", "2.3 times as fast as Wang and others (2009), on a weaker graphics card.",
          why_not="It cannot be redrawn: a ratio needs both methods in one build on one machine, and theirs is not among the techniques."),
    Claim("B5.4", "Eight environment maps, chosen by what they see, are enough.", "photons",
          test="pass_env_maps: those that are chosen see more of the surfaces than as many by chance, for 19 of 20 seeds and more."),
    Claim("B5.5", "Three to five looks find where a ray meets a map's surface.", "photons",
          test="pass_env_maps: in convex rooms .99 of the rays and more are right with three looks that begin with a bracket; "
               "of the printed scheme .73 to .92."),
    Claim("B5.6", "Pictures get smoother as photons become more.", "photons"))


def targets_of(claim, targets):
    return [t for t in targets if t.id == claim.id]


def verdict(claim, targets):
    """"met", "missed", or how many of what was asked were; "met by tests" where no figure asks for anything."""
    judged = [t.met for t in targets_of(claim, targets) if t.met is not None]
    if not claim.figure:
        return "not redrawn"
    if not targets_of(claim, targets):
        return NOT_MEASURED
    if not judged:
        return "met by tests" if claim.test else "no number"
    if all(judged):
        return "met"
    return f"missed in {judged.count(False)} of {len(judged)}" if any(judged) else "missed"


def counted(verdicts):
    """One sentence for the whole table."""
    met = sum(v in ("met", "met by tests") for v in verdicts)
    parts = sum(v.startswith("missed in") for v in verdicts)
    missed = sum(v == "missed" for v in verdicts)
    others = len(verdicts) - met - parts - missed
    tail = f", {others} not told" if others else ""
    return f"{len(verdicts)} claims: {met} met, {parts} in part, {missed} missed{tail}."
