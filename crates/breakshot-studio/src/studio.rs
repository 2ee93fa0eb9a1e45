//! Which question goes where?

use crate::cell::first_frames::FirstFrames;
use crate::cell::{editing, fit};
use crate::compare::{comparing, shown};
use crate::films::advice::{self, AdviceRequest};
use crate::films::clips::{self, Campaigns};
use crate::films::edit::{ClipChange, Edits, Undo};
use crate::films::frames::{self, Films};
use crate::films::starts::{Cameras, SeenRequest};
use crate::films::upload::{self, NotAdded, Uploads};
use crate::films::{learning, motion};
use crate::http::request::{Method, NoRequest, NotCopied, Request};
use crate::http::response::{Answer, Response};
use crate::jobs::Jobs;
use crate::pile::forecast::{self, Clouds};
use crate::pile::planning::{self, MapRequest, PlanRequest};
use crate::pile::request::Cache;
use crate::pile::{export, picture, save, settle};
use crate::project::Project;
use crate::robot::command;
use crate::templates::{self, Templates};
use breakshot::campaign::{Campaign, Source};
use breakshot::{Error, Result, estimate, files};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

/// Everything that the page can ask about.
pub(crate) struct Studio {
    project: Arc<Project>,
    cache: Arc<Cache>,
    clouds: Clouds,
    campaigns: Campaigns,
    films: Films,
    cameras: Cameras,
    first_frames: FirstFrames,
    edits: Edits,
    uploads: Uploads,
    jobs: Jobs,
    templates: Templates,
}

impl Studio {
    /// # Errors
    /// A folder that does not exist.
    pub(crate) fn open(folder: &Path, templates: Templates) -> Result<Self> {
        let project = Arc::new(Project::open(folder)?);
        Ok(Self {
            project,
            cache: Arc::default(),
            clouds: Clouds::default(),
            campaigns: Campaigns::default(),
            films: Films::default(),
            cameras: Cameras::default(),
            first_frames: FirstFrames::default(),
            edits: Edits::default(),
            uploads: Uploads::default(),
            jobs: Jobs::default(),
            templates,
        })
    }

    /// The answer to a request that may be asked.
    pub(crate) fn answer(&self, request: &Request) -> Answer {
        let parts: Vec<&str> = request.path.trim_start_matches('/').split('/').collect();
        match (request.method, &parts[..]) {
            (Method::Get, ["api", "jobs", number, "events"]) => {
                let events = number.parse().ok().and_then(|number| self.jobs.events(number));
                events.map_or_else(unknown, Answer::Events)
            }
            (Method::Get, ["api", what]) => self.shown(what, request),
            (Method::Post, ["api", "jobs", number, "cancel"]) => match number.parse() {
                Ok(number) if self.jobs.cancel(number) => Response::json(&true).into(),
                _ => unknown(),
            },
            (Method::Post, ["api", what]) => self.done(what, request),
            _ => unknown(),
        }
    }

    /// What the project holds: nothing is changed.
    fn shown(&self, what: &str, request: &Request) -> Answer {
        match what {
            "project" => Response::json(&self.project.contents()).into(),
            "stamp" => Response::json(&self.project.stamp()).into(),
            "scene" => reply(self.scene(request)),
            "strike" => reply(self.strike(request)),
            "plan" => reply(self.plan(request)),
            "clips" => reply(self.campaign(request).map(|campaign| clips::listed(&self.project, &campaign))),
            "clip" => reply(self.clip(request)),
            "film" => reply(self.film(request)),
            "film-draft" => reply(upload::drafted(&self.project, request)),
            "starts" => reply(self.starts(request)),
            "edits" => reply(self.edits.count(&self.project, request.field("campaign").unwrap_or_default())),
            "properties" => reply(self.properties(request)),
            "comparison" => reply(self.comparison(request)),
            "picture-draft" => {
                let field = |name: &str| request.field(name).unwrap_or_default();
                reply(picture::drafted(&self.project, field("objects"), field("name")))
            }
            "beneath" => self.beneath(request).unwrap_or_else(|error| reply(Err::<(), _>(error))),
            "frame" if request.field("film").is_some() => {
                self.film_frame(request).unwrap_or_else(|error| reply(Err::<(), _>(error)))
            }
            "frame" => self.frame(request).unwrap_or_else(|error| reply(Err::<(), _>(error))),
            _ => unknown(),
        }
    }

    /// What is computed, or written.
    fn done(&self, what: &str, request: &Request) -> Answer {
        let (project, cache) = (&*self.project, &*self.cache);
        match what {
            "motion" => asked(request, |r| forecast::motion(project, cache, r)),
            "cloud" => asked(request, |r| self.clouds.outlook(project, cache, r)),
            "aim" => asked(request, |r| forecast::aimed(project, cache, r)),
            "settle" => asked(request, |r| settle::settled(project, cache, r)),
            "save" => asked(request, |r| save::save(project, cache, r)),
            "strike" => asked(request, |r| save::save_strike(project, r)),
            "export" => asked(request, |r| export::exported(project, cache, r)),
            "plan" => asked(request, |r: &PlanRequest| Ok(self.start_plan(r))),
            "map" => asked(request, |r: &MapRequest| Ok(self.start_map(r))),
            "new" => asked(request, |r| save::new_scene(project, r)),
            "picture" => asked(request, |r| picture::taken(project, r)),
            "init" => asked(request, |_: &Nothing| templates::written(project, self.templates)),
            "advise" => asked(request, |r: &AdviceRequest| self.start_advice(r)),
            "start" => asked(request, |r: &SeenRequest| self.seen(r)),
            "estimate" => asked(request, |r: &EstimateRequest| self.start_estimate(r)),
            "fit" => asked(request, |r| fit::fitted(project, cache, &self.first_frames, r)),
            "save-tags" => asked(request, |r| self.save_tags(r)),
            "command" => asked(request, |r| command::found(project, cache, r)),
            "compare" => asked(request, |r| Ok(self.start_comparison(r))),
            "track" => asked(request, |r: &TrackRequest| self.start_tracking(r)),
            "clip" => asked(request, |r: &ClipChange| self.edits.change(project, r)),
            "undo" => asked(request, |r: &Undo| self.edits.undo(project, r)),
            _ => unknown(),
        }
    }

    /// Adds a film whose bytes `receive` writes.
    pub(crate) fn add_film(
        &self,
        request: &Request,
        receive: &mut dyn FnMut(&mut File) -> std::result::Result<(), NotCopied>,
    ) -> std::result::Result<Response, NoRequest> {
        let mut received = |file: &mut File| {
            receive(file).map_err(|reason| match reason {
                NotCopied::Unread(reason) => NotAdded::Cut(reason),
                NotCopied::Unwritten(source) => {
                    let path = request.field("name").unwrap_or_default().into();
                    NotAdded::Refused(Error::Write { path, source })
                }
            })
        };
        match upload::added((&self.project, &self.edits, &self.uploads), request, &mut received) {
            Ok(added) => Ok(Response::json(&added)),
            Err(NotAdded::Refused(error)) => Ok(Response::refusal(422, &error.to_string())),
            Err(NotAdded::Cut(reason)) => Err(reason),
        }
    }

    fn campaign(&self, request: &Request) -> Result<Arc<Campaign>> {
        self.campaigns.open(&self.project, request.field("campaign").unwrap_or_default())
    }

    /// What was found in a clip.
    fn clip(&self, request: &Request) -> Result<Option<motion::Motion>> {
        let campaign = self.campaign(request)?;
        let clip = clips::clip(&campaign, request.field("clip").unwrap_or_default())?;
        motion::motion(&self.project, &campaign, clip)
    }

    /// The film of a clip; none for one whose positions were measured elsewhere.
    fn film(&self, request: &Request) -> Result<Option<frames::Film>> {
        let campaign = self.campaign(request)?;
        let clip = clips::clip(&campaign, request.field("clip").unwrap_or_default())?;
        match &clip.source {
            Source::Film(path) => frames::film(path).map(Some),
            Source::Tracks { .. } => Ok(None),
        }
    }

    /// Properties as they are in their file, and the values of the single clips.
    fn properties(&self, request: &Request) -> Result<serde_json::Value> {
        let file = self.project.file(request.field("file").unwrap_or_default())?;
        let mut properties = files::load_properties(file)?;
        let values = estimate::clip_values(&properties)?;
        // The evidence behind the values is long, and not shown.
        properties.evidence = None;
        let shown = |v: &estimate::ClipValue| serde_json::json!({ "clip": v.clip, "group": v.group, "name": v.name, "value": v.value, "std": v.std });
        let clips: Vec<_> = values.iter().map(shown).collect();
        Ok(serde_json::json!({ "properties": properties, "clips": clips }))
    }

    /// A frame of a film; its time is in a header.
    fn frame(&self, request: &Request) -> Result<Answer> {
        let campaign = self.campaign(request)?;
        let clip = clips::clip(&campaign, request.field("clip").unwrap_or_default())?;
        let (Source::Film(path), Some(Ok(number))) = (&clip.source, request.field("frame").map(str::parse))
        else {
            return Ok(unknown());
        };
        let rate_hz = clip.frame_rate_hz.or(campaign.cell.camera.frame_rate_hz);
        let Some(picture) = self.films.picture(path, rate_hz, number)? else { return Ok(unknown()) };
        Ok(Response::new("image/png", picture.png.clone())
            .with("Frame-Time", picture.time_s.to_string())
            .into())
    }

    /// The number of the job; none if too many are running.
    fn start_tracking(&self, request: &TrackRequest) -> Result<Option<u64>> {
        let campaign = self.campaigns.open(&self.project, &request.campaign)?;
        clips::clip(&campaign, &request.clip)?;
        let (project, number) = (self.project.clone(), request.clip.clone());
        Ok(self
            .jobs
            .start(move |job| motion::track(&project, &campaign, clips::clip(&campaign, &number)?, job)))
    }

    fn scene(&self, request: &Request) -> Result<serde_json::Value> {
        let loaded = self.cache.scene_file(&self.project, request.field("file").unwrap_or_default())?;
        Ok(serde_json::json!({ "scene": loaded.0, "notes": loaded.1 }))
    }

    fn strike(&self, request: &Request) -> Result<breakshot::scene::Strike> {
        files::load_strike(self.project.file(request.field("file").unwrap_or_default())?)
    }

    fn plan(&self, request: &Request) -> Result<breakshot::plan::Plan> {
        files::read_json(&self.project.file(request.field("file").unwrap_or_default())?)
    }

    /// The number of the job; none if too many are running.
    fn start_plan(&self, request: &PlanRequest) -> Option<u64> {
        let (project, cache, request) = (self.project.clone(), self.cache.clone(), request.clone());
        self.jobs.start(move |job| planning::planned(&project, &cache, &request, job))
    }

    /// The number of the job; none if too many are running.
    fn start_estimate(&self, request: &EstimateRequest) -> Result<Option<u64>> {
        let campaign = self.campaigns.open(&self.project, &request.campaign)?;
        let (project, output) = (self.project.clone(), request.output.clone());
        Ok(self.jobs.start(move |job| learning::learned(&project, &campaign, &output, job)))
    }

    /// The number of the job; none if too many are running.
    fn start_map(&self, request: &MapRequest) -> Option<u64> {
        let (project, cache, request) = (self.project.clone(), self.cache.clone(), request.clone());
        self.jobs.start(move |job| planning::map(&project, &cache, &request, job))
    }
}

/// Starts of clips, pictures of piles, advice.
impl Studio {
    /// The objects of a clip in its first frame.
    fn starts(&self, request: &Request) -> Result<Vec<crate::films::starts::Seen>> {
        let campaign = self.campaign(request)?;
        self.cameras.listed(&self.project, &campaign, request.field("clip").unwrap_or_default())
    }

    fn seen(&self, request: &SeenRequest) -> Result<crate::films::starts::Seen> {
        self.cameras.seen(&self.campaigns.open(&self.project, &request.campaign)?, request)
    }

    /// A picture beneath a scene.
    fn beneath(&self, request: &Request) -> Result<Answer> {
        let field = |name: &str| request.field(name).unwrap_or_default();
        let png = picture::beneath(&self.project, &self.cache, field("scene"), field("picture"))?;
        Ok(Response::new("image/png", png).into())
    }

    /// The number of the job; none if too many are running.
    fn start_advice(&self, request: &AdviceRequest) -> Result<Option<u64>> {
        let campaign = self.campaigns.open(&self.project, &request.campaign)?;
        let (project, request) = (self.project.clone(), request.clone());
        Ok(self.jobs.start(move |job| advice::advised(&project, &campaign, &request, job)))
    }
}

/// The views beside films, properties and pile.
impl Studio {
    fn comparison(&self, request: &Request) -> Result<shown::Shown> {
        shown::shown(&self.project, &self.cache, request.field("file").unwrap_or_default())
    }

    /// Writes positions of tags; the films are seen through the new camera from then on.
    fn save_tags(&self, request: &editing::SaveTags) -> Result<String> {
        let saved = editing::save(&self.project, request)?;
        self.campaigns.forget();
        Ok(saved)
    }

    /// A frame of a film of the project, as it is decoded; its time is in a header.
    fn film_frame(&self, request: &Request) -> Result<Answer> {
        let path = self.project.file(request.field("film").unwrap_or_default())?;
        let Some(Ok(number)) = request.field("frame").map(str::parse) else { return Ok(unknown()) };
        let Some(picture) = self.films.picture(&path, None, number)? else { return Ok(unknown()) };
        Ok(Response::new("image/png", picture.png.clone())
            .with("Frame-Time", picture.time_s.to_string())
            .into())
    }

    /// The number of the job; none if too many are running.
    fn start_comparison(&self, request: &comparing::CompareRequest) -> Option<u64> {
        let (project, cache, request) = (self.project.clone(), self.cache.clone(), request.clone());
        self.jobs.start(move |job| comparing::compared(&project, &cache, &request, job))
    }
}

/// A campaign from which the properties are to be estimated.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct EstimateRequest {
    campaign: String,
    /// The file to write.
    output: String,
}

/// A question without anything to say.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Nothing {}

/// A clip to be tracked.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct TrackRequest {
    campaign: String,
    /// Its number in the campaign.
    clip: String,
}

fn unknown() -> Answer {
    Response::refusal(404, "there is no such thing here").into()
}

fn reply(result: Result<impl Serialize>) -> Answer {
    match result {
        Ok(value) => Response::json(&value),
        Err(error) => Response::refusal(422, &error.to_string()),
    }
    .into()
}

/// Answers a question whose body is JSON.
fn asked<Q: DeserializeOwned, A: Serialize>(
    request: &Request,
    answer: impl FnOnce(&Q) -> Result<A>,
) -> Answer {
    match serde_json::from_slice(&request.body) {
        Ok(question) => reply(answer(&question)),
        Err(error) => Response::refusal(400, &format!("the question is not understood: {error}")).into(),
    }
}
