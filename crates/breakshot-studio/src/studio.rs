//! Which question goes where?

use crate::http::request::{Method, Request};
use crate::http::response::{Answer, Response};
use crate::jobs::Jobs;
use crate::pile::forecast::{self, Clouds};
use crate::pile::planning::{self, PlanRequest};
use crate::pile::request::Cache;
use crate::pile::{save, settle};
use crate::project::Project;
use breakshot::{Result, files};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;
use std::sync::Arc;

/// Everything that the page can ask about.
pub(crate) struct Studio {
    project: Arc<Project>,
    cache: Arc<Cache>,
    clouds: Clouds,
    jobs: Jobs,
}

impl Studio {
    /// # Errors
    /// A folder that does not exist.
    pub(crate) fn open(folder: &Path) -> Result<Self> {
        let project = Arc::new(Project::open(folder)?);
        Ok(Self { project, cache: Arc::default(), clouds: Clouds::default(), jobs: Jobs::default() })
    }

    /// The answer to a request that may be asked.
    pub(crate) fn answer(&self, request: &Request) -> Answer {
        let parts: Vec<&str> = request.path.trim_start_matches('/').split('/').collect();
        let (project, cache) = (&*self.project, &*self.cache);
        match (request.method, &parts[..]) {
            (Method::Get, ["api", "project"]) => Response::json(&project.contents()).into(),
            (Method::Get, ["api", "scene"]) => reply(self.scene(request)),
            (Method::Get, ["api", "strike"]) => reply(self.strike(request)),
            (Method::Get, ["api", "plan"]) => reply(self.plan(request)),
            (Method::Get, ["api", "jobs", number, "events"]) => {
                let events = number.parse().ok().and_then(|number| self.jobs.events(number));
                events.map_or_else(unknown, Answer::Events)
            }
            (Method::Post, ["api", "motion"]) => asked(request, |r| forecast::motion(project, cache, r)),
            (Method::Post, ["api", "cloud"]) => asked(request, |r| self.clouds.outlook(project, cache, r)),
            (Method::Post, ["api", "aim"]) => asked(request, |r| forecast::aimed(project, cache, r)),
            (Method::Post, ["api", "settle"]) => asked(request, |r| settle::settled(project, cache, r)),
            (Method::Post, ["api", "save"]) => asked(request, |r| save::save(project, cache, r)),
            (Method::Post, ["api", "strike"]) => asked(request, |r| save::save_strike(project, r)),
            (Method::Post, ["api", "plan"]) => asked(request, |r: &PlanRequest| Ok(self.start_plan(r))),
            (Method::Post, ["api", "jobs", number, "cancel"]) => match number.parse() {
                Ok(number) if self.jobs.cancel(number) => Response::json(&true).into(),
                _ => unknown(),
            },
            _ => unknown(),
        }
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
